# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Gamepads: presets, state, hot-plug, deadman."""

from .controls import AT_REST, Axis, Button, Deadman, DEADMAN_BUTTONS, GamepadState, Grip, Timeout
from .gamepad import Gamepad
from .presets import AUTO, PRESETS

__all__ = [
    'AT_REST',
    'AUTO',
    'DEADMAN_BUTTONS',
    'PRESETS',
    'Axis',
    'Button',
    'Deadman',
    'Gamepad',
    'GamepadState',
    'Grip',
    'Timeout',
]
