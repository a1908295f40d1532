# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keyboard and gamepad for a walking robot, and a multiplexer of velocity commands."""

from .body_pose import BodyPose
from .exceptions import CommandError, SettingError, TeleopError
from .modes import Mode
from .speeds import Speeds
from .velocity import Velocity

__all__ = [
    'BodyPose',
    'CommandError',
    'Mode',
    'SettingError',
    'Speeds',
    'TeleopError',
    'Velocity',
]
