# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What moves while the deadman of a gamepad is held."""

from __future__ import annotations

from abc import ABC, abstractmethod
import math
from typing import Generic

from ..command_stream import CommandStream
from ..session import Command
from .controls import AT_REST, GamepadState
from .deadman import Deadman, Grip, Timeout


class DeadmanTeleop(ABC, Generic[Command]):
    """Publishes what a gamepad wants; pure, time is handed in.

    A motion ends when the gamepad has not changed for longer than a hand holds it so still; the
    deadman has to be released and pressed anew then.

    Attributes:
        state: Last state of the gamepad.
        expired: Whether a motion has ended so, and the deadman was not released since.
    """

    def __init__(self, deadman: Deadman, stream: CommandStream[Command]) -> None:
        """Start idle.

        Args:
            deadman: Which buttons allow motion.
            stream: Decides when to publish.
        """
        self.state = AT_REST
        self.expired = False
        self._deadman = deadman
        self._stream = stream
        self._is_alive = True  # the gamepad has changed since the last step
        self._changed_at = 0.0  # [s]

    @property
    def grip(self) -> Grip:
        """What the person allows at the moment."""
        return Grip.RELEASED if self.expired else self._deadman.grip(self.state)

    @property
    def timeout(self) -> Timeout:
        """Time without any change of the gamepad after which a motion ends, as it is held."""
        return self._deadman.timeout_at(self.state)

    @abstractmethod
    def wanted(self) -> Command | None:
        """Return the command that is wanted; None without the deadman."""

    def take(self, state: GamepadState) -> GamepadState:
        """Take a state of the gamepad, at rest when there is none; return the one before."""
        before, self.state = self.state, state
        changed = state != before or state.changes != before.changes
        self._is_alive |= changed
        released = self._deadman.grip(state) is Grip.RELEASED
        if released or (changed and self._deadman.enable is None):
            self.expired = False
        return before

    def step(self, now: float) -> Command | None:
        """Return what to publish now; call it after every state and when it is due.

        Args:
            now: Time [s].
        """
        if self._is_alive or not self._moves:
            self._is_alive, self._changed_at = False, now
        elif now - self._changed_at >= self.timeout.duration:
            self.expired = True
        return self._stream.step(self.wanted(), now)

    def due(self, _now: float) -> float:
        """Return when step() has to be called at the latest [s]; may be infinite."""
        expires = self._changed_at + self.timeout.duration if self._moves else math.inf
        return min(self._stream.due(), expires)

    @property
    def _moves(self) -> bool:
        command = self.wanted()
        return command is not None and not self._stream.is_rest(command)

    def end(self) -> None:
        """Let go of everything at the end of the program."""
        self.state = AT_REST
        self._stream.end()
