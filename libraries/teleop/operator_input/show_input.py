# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run operator_input show_keys`` and ``show_gamepad``: print key and gamepad events."""

from __future__ import annotations

import argparse
import contextlib
import signal
import sys
import time

from .exceptions import PresetError, TerminalError
from .gamepad import AUTO, Gamepad, GamepadState
from .keyboard import Keyboard, ReleaseSource
from .keys import HeldKeys

EXPLANATIONS = {
    ReleaseSource.TERMINAL: 'the terminal (Kitty protocol)',
    ReleaseSource.KEYBOARD: 'the keyboard itself (evdev)',
    ReleaseSource.TIME_OUT: 'none: time-outs',
}


def show_keys() -> None:
    """Entry point: shows key events until Ctrl-C or q."""
    try:
        with Keyboard() as keyboard:
            _show_keys(keyboard)
    except TerminalError as error:
        sys.exit(f'error: {error}')


def _show_keys(keyboard: Keyboard) -> None:
    line, held = keyboard.status_line(), HeldKeys()
    line.message('press and hold keys; q or Ctrl-C ends')
    while True:
        for event in keyboard.wait(0.05):
            held.feed(event)
            line.message(f'{event.time:12.3f}  {event.key:10}  {event.action.value}')
            if event.is_stroke and event.key in {'q', 'ctrl+c'}:
                line.end()
                return
        names = ' '.join(held.held(time.monotonic())) or 'nothing'
        line.show(f'held: {names}    releases come from: {EXPLANATIONS[keyboard.release_source]}')


def show_gamepad() -> None:
    """Entry point: prints each change until Ctrl-C."""
    # a script's shell starts background jobs with SIGINT ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)
    parser = argparse.ArgumentParser(description=show_gamepad.__doc__, allow_abbrev=False)
    parser.add_argument('--preset', default=AUTO, help='auto, xbox, ps or generic')
    parser.add_argument('--device', default='', help='path, or expression for the name')
    options = parser.parse_args()
    try:
        gamepad = Gamepad(preset=options.preset, device=options.device, log=_print, warn=_print)
    except PresetError as error:
        sys.exit(f'error: {error}')
    with contextlib.suppress(KeyboardInterrupt):
        while True:
            for state in gamepad.wait(0.5):
                _print(_text(state))


def _text(state: GamepadState) -> str:
    axes = '  '.join(f'{axis.value} {way:+.2f}' for axis, way in state.axes.items() if way)
    buttons = ', '.join(sorted(button.value for button in state.buttons))
    return f'[{buttons}]  {axes}'.rstrip()


def _print(text: str) -> None:
    sys.stdout.write(text + '\n')
    sys.stdout.flush()
