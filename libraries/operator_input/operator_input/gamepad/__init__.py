# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Gamepads: presets, state, hot-plug, deadman."""

from .controls import AT_REST, Axis, Button, GamepadState
from .deadman import Deadman, DEADMAN_BUTTONS, Grip, is_pressed, Timeout
from .gamepad import Gamepad
from .presets import AUTO, PRESETS
from .session import GamepadSession
from .teleop import DeadmanTeleop

__all__ = [
    'AT_REST',
    'AUTO',
    'DEADMAN_BUTTONS',
    'PRESETS',
    'Axis',
    'Button',
    'Deadman',
    'DeadmanTeleop',
    'Gamepad',
    'GamepadSession',
    'GamepadState',
    'Grip',
    'Timeout',
    'is_pressed',
]
