# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Operator input for robots: keys with their releases, from any terminal, and gamepads."""

from .exceptions import DeviceError, OperatorInputError, PresetError, SettingError, TerminalError
from .keyboard import Keyboard, ReleaseSource
from .keys import all_released, AutoRepeat, HeldKeys, KeyAction, KeyEvent
from .program import (
    CommandStream,
    DeadmanMapping,
    KeyMapping,
    ProgramRequest,
    RESTS,
    Robot,
    TeleopMapping,
    TeleopProgram,
)
from .terminal import status_text, StatusLine, StatusPart, Style, TerminalKeyboard

__all__ = [
    'RESTS',
    'AutoRepeat',
    'CommandStream',
    'DeadmanMapping',
    'DeviceError',
    'HeldKeys',
    'KeyAction',
    'KeyEvent',
    'KeyMapping',
    'Keyboard',
    'OperatorInputError',
    'PresetError',
    'ProgramRequest',
    'ReleaseSource',
    'Robot',
    'SettingError',
    'StatusLine',
    'StatusPart',
    'Style',
    'TeleopMapping',
    'TeleopProgram',
    'TerminalError',
    'TerminalKeyboard',
    'all_released',
    'status_text',
]
