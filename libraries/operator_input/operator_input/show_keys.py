# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run operator_input show_keys``: how this terminal reports its keys."""

from __future__ import annotations

import sys
import time

from .exceptions import TerminalError
from .held_keys import HeldKeys
from .keyboard import Keyboard, ReleaseSource

EXPLANATIONS = {
    ReleaseSource.TERMINAL: 'the terminal (Kitty protocol)',
    ReleaseSource.KEYBOARD: 'the keyboard itself (evdev)',
    ReleaseSource.TIME_OUT: 'none: time-outs',
}


def main() -> None:
    """Entry point: shows key events until Ctrl-C or q."""
    try:
        with Keyboard() as keyboard:
            _show(keyboard)
    except TerminalError as error:
        sys.exit(f'error: {error}')


def _show(keyboard: Keyboard) -> None:
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
