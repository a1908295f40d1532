# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keyboard and gamepad for a walking robot, and a multiplexer of velocity commands."""

from .exceptions import CommandError, SettingError, TeleopError
from .motion import BodyPose, Mode, Speeds, Velocity

__all__ = [
    'BodyPose',
    'CommandError',
    'Mode',
    'SettingError',
    'Speeds',
    'TeleopError',
    'Velocity',
]
