# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One person with one gamepad."""

from __future__ import annotations

from abc import abstractmethod
import select
import threading
import time

from ..devices import KernelDevices
from ..session import Command, LONGEST_WAIT, Session
from .controls import GamepadState
from .gamepad import Gamepad
from .teleop import DeadmanTeleop


class GamepadSession(Session[Command]):
    """A gamepad that may come and go."""

    def __init__(
        self, gamepad: Gamepad, teleop: DeadmanTeleop[Command], stop: threading.Event
    ) -> None:
        """Prepare.

        Args:
            gamepad: What is read.
            teleop: Decides what to publish.
            stop: Ends it.
        """
        super().__init__(teleop, stop)
        self._gamepad = gamepad
        self._deadman = teleop
        self._had_expired = False

    @abstractmethod
    def take(self, state: GamepadState) -> None:
        """Hand a state of the gamepad on, and handle requests besides motion."""

    @abstractmethod
    def warn(self, text: str) -> None:
        """Warn the person."""

    def begin(self) -> None:
        """Return why there is no gamepad, if there is none."""
        self._gamepad.scan(time.monotonic())
        if not self._gamepad.is_connected:
            problem = KernelDevices().problem() or 'plug one in, or switch it on'
            self.warn(f'no gamepad yet: {problem}')

    def serve(self) -> None:
        """Wait for the gamepad, publish."""
        now = time.monotonic()
        self._gamepad.scan(now)
        wait = min(max(self._moves.due(now) - now, 0.0), LONGEST_WAIT)
        select.select(self._gamepad.filenos(), [], [], wait)
        for state in self._gamepad.read():
            self.take(state)
            self.step(time.monotonic())
        self.step(time.monotonic())
        if self._deadman.expired and not self._had_expired:
            timeout = self._deadman.timeout
            self.warn(
                f'the gamepad has not changed for {timeout.duration:g} s ({timeout.parameter}), '
                'so the motion ended; is it on, and in reach? Release and press the deadman'
            )
        self._had_expired = self._deadman.expired
        self.spin()
        self.attend(time.monotonic())

    def end(self) -> None:
        """Publish the last rests; nothing is read any more."""
        self._gamepad.close()
        super().end()
