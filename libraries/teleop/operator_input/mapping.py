# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What keys and sticks mean to a robot. Pure: times are handed in, on a monotonic clock [s].

A mapping returns commands, which move the robot as long as they are wanted, and requests, which
are made once: a text is shown to the person, a :class:`ProgramRequest` concerns the program, and
all others are the robot's.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from enum import auto, Enum
import math
from typing import Any, Protocol

from .command_stream import CommandStream
from .gamepad import AT_REST, Deadman, GamepadState, Grip, Timeout
from .held_keys import HeldKeys
from .status import StatusPart


class ProgramRequest(Enum):
    """What a person requests of any program."""

    QUIT = auto()
    SUSPEND = auto()
    """Give the terminal back to the shell for a while."""


class Robot(Protocol):
    """Who is commanded. Nothing of it waits, but flush().

    Attributes:
        say: Shows the person a message; the program sets it to its screen.
    """

    say: Callable[[str], None]

    def publish(self, command: Any) -> None:  # noqa: ANN401  # what its mappings want
        """Publish a command."""

    def handle(self, request: Any, now: float) -> None:  # noqa: ANN401
        """Send a request of a mapping."""

    def serve(self, now: float) -> None:
        """Process answers, and send what is due."""

    def flush(self) -> None:
        """Wait until what was published has arrived, for a while at most."""


class TeleopMapping(ABC):
    """What the events of a source mean to a robot.

    Attributes:
        robot: Who is commanded.
        introduction: What a person at a terminal reads first.
    """

    introduction = ''

    def __init__(self, robot: Robot, stream: CommandStream[Any]) -> None:
        self.robot = robot
        self._stream = stream

    @abstractmethod
    def feed(self, event: Any) -> Sequence[object]:  # noqa: ANN401  # of its source
        """Map an event of the source to the person's requests."""

    @abstractmethod
    def wanted(self, now: float) -> object | None:
        """Return the command that is wanted; None when nothing asks for one."""

    def status(self, now: float) -> list[StatusPart]:  # of a program at a terminal
        """Return what the status line shows, what matters most first."""
        return []

    def step(self, now: float) -> object | None:
        """Return what to publish now; call it after every event and when it is due."""
        return self._stream.step(self.wanted(now), now)

    def due(self, now: float) -> float:
        """Return when step() has to be called at the latest; may be infinite."""
        return self._stream.due()

    def end(self) -> None:
        """Release everything at the end of the program."""
        self._stream.end()


class KeyMapping(TeleopMapping):
    """What keys mean: a command as long as a key is held."""

    def __init__(self, robot: Robot, held: HeldKeys, stream: CommandStream[Any]) -> None:
        super().__init__(robot, stream)
        self._held = held

    def due(self, now: float) -> float:
        """Return when step() has to be called at the latest; may be infinite."""
        return min(self._held.deadline(now), super().due(now))

    def end(self) -> None:
        """Release everything at the end of the program."""
        self._held.clear()
        super().end()


class DeadmanMapping(TeleopMapping):
    """What a gamepad means: a command as long as its deadman is held.

    A motion ends when the gamepad has not changed for longer than a hand holds it so still; the
    deadman has to be released and pressed anew then.

    Attributes:
        state: Last state of the gamepad.
        expired: Whether a motion has ended so, and the deadman was not released since.
    """

    def __init__(
        self,
        robot: Robot,
        deadman: Deadman,
        stream: CommandStream[Any],
        warn: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Start idle; a motion that ends because the gamepad does not change is warned of."""
        super().__init__(robot, stream)
        self.state = AT_REST
        self.expired = False
        self._deadman = deadman
        self._warn = warn
        self._is_alive = True  # the gamepad has changed since the last step
        self._changed_at = 0.0

    @property
    def grip(self) -> Grip:
        """What the person allows at the moment."""
        return Grip.RELEASED if self.expired else self._deadman.grip(self.state)

    def take(self, state: GamepadState) -> GamepadState:
        """Store a state of the gamepad, at rest when there is none; return the previous one."""
        before, self.state = self.state, state
        changed = state != before or state.changes != before.changes
        self._is_alive |= changed
        released = self._deadman.grip(state) is Grip.RELEASED
        if released or (changed and self._deadman.enable is None):
            self.expired = False
        return before

    def step(self, now: float) -> object | None:
        """Return what to publish now; call it after every state and when it is due."""
        if self._is_alive or not self._moves(now):
            self._is_alive, self._changed_at = False, now
        elif now - self._changed_at >= self._timeout.duration:
            self.expired = True
            self._warn(
                f'the gamepad has not changed for {self._timeout.duration:g} s '
                f'({self._timeout.parameter}), so the motion ended; is it on, and in reach? '
                'Release and press the deadman'
            )
        return super().step(now)

    def due(self, now: float) -> float:
        """Return when step() has to be called at the latest; may be infinite."""
        expires = self._changed_at + self._timeout.duration if self._moves(now) else math.inf
        return min(super().due(now), expires)

    def end(self) -> None:
        """Release everything at the end of the program."""
        self.state = AT_REST
        super().end()

    @property
    def _timeout(self) -> Timeout:
        return self._deadman.timeout_at(self.state)

    def _moves(self, now: float) -> bool:
        command = self.wanted(now)
        return command is not None and not self._stream.is_rest(command)
