# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What moves while the deadman of a gamepad is held."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Generic

from ..command_stream import CommandStream
from ..session import Command
from .controls import AT_REST, GamepadState
from .deadman import Deadman, Grip


class DeadmanTeleop(ABC, Generic[Command]):
    """Publishes what a gamepad wants; pure, time is handed in.

    Attributes:
        state: What the gamepad said last.
    """

    def __init__(self, deadman: Deadman, stream: CommandStream[Command]) -> None:
        """Start idle.

        Args:
            deadman: Which buttons allow motion.
            stream: Decides when to publish.
        """
        self.state = AT_REST
        self._deadman = deadman
        self._stream = stream

    @property
    def grip(self) -> Grip:
        """What the person allows at the moment."""
        return self._deadman.grip(self.state)

    @abstractmethod
    def wanted(self) -> Command | None:
        """Return the command that is wanted; None without the deadman."""

    def take(self, state: GamepadState) -> GamepadState:
        """Take a state of the gamepad, at rest when there is none; return the one before."""
        before, self.state = self.state, state
        return before

    def step(self, now: float) -> Command | None:
        """Say what to publish now; call it after every state and when it is due.

        Args:
            now: Time [s].
        """
        return self._stream.step(self.wanted(), now)

    def due(self, _now: float) -> float:
        """Return when step() has to be called at the latest [s]; may be infinite."""
        return self._stream.due()

    def end(self) -> None:
        """Let go of everything at the end of the program."""
        self.state = AT_REST
        self._stream.end()
