# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The XGO quadruped as a URDF, made from its numbers; nothing here imports rclpy."""

from .exceptions import DescriptionError, PresetError
from .feet import foot_position, raised_feet, standing_height
from .joint_commands import STREAM_TIMEOUT
from .joints import Joint, LEGS, movable_joints
from .poses import Pose, pose_positions
from .urdf import PRESETS, robot_urdf

__all__ = [
    'LEGS',
    'PRESETS',
    'STREAM_TIMEOUT',
    'DescriptionError',
    'Joint',
    'Pose',
    'PresetError',
    'foot_position',
    'movable_joints',
    'pose_positions',
    'raised_feet',
    'robot_urdf',
    'standing_height',
]
