# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How training tools call the terms of an observation, and what they are made of here.

Only what a name says in its tool stands here. The frame of an IMU's angular velocity is in no
name but those of functions that take the root's (Isaac Lab, ``isaaclab.envs.mdp.observations``).
"""

from __future__ import annotations

from typing import Any

from .model import Source

RELATIVE = {'source': Source.JOINT_POSITIONS.value, 'relative': True}
ABSOLUTE = {'source': Source.JOINT_POSITIONS.value, 'relative': False}

COMMON: dict[str, dict[str, Any]] = {
    'base_lin_vel': {'source': Source.LINEAR_VELOCITY.value},
    'lin_vel': {'source': Source.LINEAR_VELOCITY.value},
    'base_ang_vel': {'source': Source.ANGULAR_VELOCITY.value},
    'ang_vel': {'source': Source.ANGULAR_VELOCITY.value},
    'gyro': {'source': Source.ANGULAR_VELOCITY.value},
    'imu_ang_vel': {'source': Source.ANGULAR_VELOCITY.value},
    'gravity': {'source': Source.GRAVITY.value},
    'gravity_vec': {'source': Source.GRAVITY.value},
    'projected_gravity': {'source': Source.GRAVITY.value},
    'root_quat_w': {'source': Source.ORIENTATION.value, 'order': 'wxyz'},
    'cmd': {'source': Source.COMMAND.value},
    'command': {'source': Source.COMMAND.value},
    'commands': {'source': Source.COMMAND.value},
    'generated_commands': {'source': Source.COMMAND.value},
    'velocity_command': {'source': Source.COMMAND.value},
    'velocity_commands': {'source': Source.COMMAND.value},
    'phase': {'source': Source.PHASE.value},
    'gait_phase': {'source': Source.PHASE.value},
    'joint_pos_rel': RELATIVE,
    'joint_vel': {'source': Source.JOINT_VELOCITIES.value},
    'joint_vel_rel': {'source': Source.JOINT_VELOCITIES.value},
    'dof_vel': {'source': Source.JOINT_VELOCITIES.value},
    'prev_action': {'source': Source.LAST_ACTION.value},
    'last_action': {'source': Source.LAST_ACTION.value},
    'last_actions': {'source': Source.LAST_ACTION.value},
    'action': {'source': Source.LAST_ACTION.value},
    'actions': {'source': Source.LAST_ACTION.value},
    'foot_contact': {'source': Source.FOOT_CONTACTS.value},
    'feet_contact': {'source': Source.FOOT_CONTACTS.value},
    'height_scan': {'source': Source.HEIGHT_SCAN.value},
}
"""Names that mean the same in all of them."""

MJLAB = COMMON | {'joint_pos': RELATIVE}
"""mjlab (and the vendor's training): ``joint_pos`` is relative to the default pose."""

ISAAC_LAB = COMMON | {
    'joint_pos': ABSOLUTE,
    'base_lin_vel': {'source': Source.LINEAR_VELOCITY.value, 'frame': 'base'},
    'base_ang_vel': {'source': Source.ANGULAR_VELOCITY.value, 'frame': 'base'},
}
"""Isaac Lab: velocities are those of the root, ``joint_pos`` is absolute."""

RL_SAR = COMMON | {'dof_pos': RELATIVE}
"""rl_sar and legged_gym: ``dof_pos`` is relative to the default pose."""
