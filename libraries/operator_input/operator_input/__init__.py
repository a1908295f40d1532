# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a person moves a robot with: keys, with their release, from any terminal; and gamepads."""

from .auto_repeat import AutoRepeat
from .command_stream import CommandStream
from .exceptions import DeviceError, OperatorInputError, PresetError, SettingError, TerminalError
from .held_keys import HeldKeys
from .keyboard import Keyboard, ReleaseSource
from .keyboard_session import KeyboardSession
from .keys import all_released, KeyAction, KeyEvent
from .requests import Note, Quit, Suspend
from .session import Session
from .status_text import RELEASE_WORDS, status_text, Style
from .terminal import StatusLine, TerminalKeyboard

__all__ = [
    'RELEASE_WORDS',
    'AutoRepeat',
    'CommandStream',
    'DeviceError',
    'HeldKeys',
    'KeyAction',
    'KeyEvent',
    'Keyboard',
    'KeyboardSession',
    'Note',
    'OperatorInputError',
    'PresetError',
    'Quit',
    'ReleaseSource',
    'Session',
    'SettingError',
    'StatusLine',
    'Style',
    'Suspend',
    'TerminalError',
    'TerminalKeyboard',
    'all_released',
    'status_text',
]
