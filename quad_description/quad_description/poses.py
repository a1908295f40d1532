# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Poses to start from: joint positions by name."""

from __future__ import annotations

from enum import Enum
from typing import Any, Final

from .kinematics.leg import LEGS
from .presets import robot_numbers

STREAM_TIMEOUT: Final = 0.5
"""A pause [s] that ends a stream of joint commands: a robot that it leaves with a foot in the air
is laid down by the hardware node, so the next stream has to begin where the joints are then."""


_LEG_JOINTS = ('hip', 'thigh', 'calf')
_ARM_JOINTS = ('yaw', 'thigh', 'calf')
_GRIPPER = 'hand_right_joint'


class Pose(Enum):
    """A pose that robot.yaml has the numbers of."""

    STAND = 'stand'
    LIE = 'lie'


def pose_positions(pose: Pose, arm: bool = False) -> dict[str, float]:
    """Return the joint positions of a pose.

    Returns:
        Positions in [rad], for the gripper in [m], by the joint's name in the order of the URDF.
    """
    numbers: dict[str, Any] = robot_numbers()['poses'][pose.value]
    positions = {
        f'{leg}_{joint}_joint': float(value)
        for leg in LEGS
        for joint, value in zip(_LEG_JOINTS, numbers['leg'], strict=True)
    }
    if arm:
        for joint, value in zip(_ARM_JOINTS, numbers['arm'], strict=True):
            positions[f'arm_{joint}_joint'] = float(value)
        positions[_GRIPPER] = 0.0
    return positions
