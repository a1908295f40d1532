# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a person moves a robot with: keys, with their release, from any terminal; and gamepads."""

from .command_stream import CommandStream, RESTS
from .exceptions import DeviceError, OperatorInputError, PresetError, SettingError, TerminalError
from .held_keys import AutoRepeat, HeldKeys
from .keyboard import Keyboard, ReleaseSource
from .keys import all_released, KeyAction, KeyEvent
from .mapping import DeadmanMapping, KeyMapping, ProgramRequest, Robot, TeleopMapping
from .program import TeleopProgram
from .status import status_text, StatusLine, StatusPart, Style
from .terminal import TerminalKeyboard

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
