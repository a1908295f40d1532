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

NAMES = {
    Source.LINEAR_VELOCITY: ('base_lin_vel', 'lin_vel'),
    Source.ANGULAR_VELOCITY: ('base_ang_vel', 'ang_vel', 'gyro', 'imu_ang_vel'),
    Source.GRAVITY: ('gravity', 'gravity_vec', 'projected_gravity'),
    Source.COMMAND: (
        *('cmd', 'command', 'commands', 'generated_commands'),
        *('velocity_command', 'velocity_commands'),
    ),
    Source.PHASE: ('phase', 'gait_phase'),
    Source.JOINT_VELOCITIES: ('joint_vel', 'joint_vel_rel', 'dof_vel'),
    Source.LAST_ACTION: ('prev_action', 'last_action', 'last_actions', 'action', 'actions'),
    Source.FOOT_CONTACTS: ('foot_contact', 'feet_contact'),
    Source.HEIGHT_SCAN: ('height_scan',),
}
COMMON: dict[str, dict[str, Any]] = {
    **{name: {'source': source.value} for source, names in NAMES.items() for name in names},
    'root_quat_w': {'source': Source.ORIENTATION.value, 'order': 'wxyz'},
    'joint_pos_rel': RELATIVE,
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
