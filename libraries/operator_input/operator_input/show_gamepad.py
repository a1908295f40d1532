# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run operator_input show_gamepad``: what a gamepad's sticks and buttons are called."""

from __future__ import annotations

import argparse
import contextlib
import select
import signal
import sys
import time

from .devices.kernel import KernelDevices
from .exceptions import PresetError
from .gamepad import AUTO, Gamepad, GamepadState

WAIT = 0.5  # [s]


def main() -> None:
    """Entry point: prints each change until Ctrl-C."""
    # a script's shell starts background jobs with SIGINT ignored
    signal.signal(signal.SIGINT, signal.default_int_handler)
    parser = argparse.ArgumentParser(description=main.__doc__, allow_abbrev=False)
    parser.add_argument('--preset', default=AUTO, help='auto, xbox, ps or generic')
    parser.add_argument('--device', default='', help='path, or expression for the name')
    options = parser.parse_args()
    try:
        gamepad = Gamepad(
            KernelDevices(), preset=options.preset, device=options.device, log=_print
        )
    except PresetError as error:
        sys.exit(f'error: {error}')
    with contextlib.suppress(KeyboardInterrupt):
        _show(gamepad)


def _show(gamepad: Gamepad) -> None:
    gamepad.scan(time.monotonic())
    if not gamepad.is_connected:
        problem = KernelDevices().problem() or 'plug one in, or switch it on'
        _print(f'no gamepad yet: {problem}')
    while True:
        gamepad.scan(time.monotonic())
        select.select(gamepad.filenos(), [], [], WAIT)
        for state in gamepad.read():
            _print(_text(state))


def _text(state: GamepadState) -> str:
    axes = '  '.join(f'{axis.value} {way:+.2f}' for axis, way in state.axes.items() if way)
    buttons = ', '.join(sorted(button.value for button in state.buttons))
    return f'[{buttons}]  {axes}'.rstrip()


def _print(text: str) -> None:
    sys.stdout.write(text + '\n')
    sys.stdout.flush()
