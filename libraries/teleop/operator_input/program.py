# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Teleoperation program: the mapping of keys and sticks to commands, and the main loop.

A mapping returns commands, which move the robot while they last, and one-time requests: a text is
shown to the operator, a :class:`ProgramRequest` goes to the program, and any other request to the
robot. Mappings are pure: callers pass times, on a monotonic clock in [s].
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from enum import auto, Enum
import math
import os
import signal
import threading
import time
from typing import Any, Generic, Protocol, TypeVar

from .gamepad import AT_REST, Deadman, Gamepad, GamepadState, Grip, Timeout
from .keyboard import Keyboard, ReleaseSource
from .keys import HeldKeys
from .terminal import status_text, StatusPart, Style

T = TypeVar('T')

RESTS = 3  # commands to rest at the end of a motion: one might be lost, more would be a stream


class CommandStream(Generic[T]):
    """Converts the wanted command to messages to publish; pure, times are in [s].

    A change is published at once, an unchanged command once a period. An idle source publishes
    nothing, so that it does not override others.
    """

    def __init__(self, period: float, rest: Callable[[T | None], T]) -> None:
        """Start idle.

        Args:
            period: Time between two messages of an unchanged command.
            rest: Returns the command that ends a motion, from the last command of the motion, or
                None without one.

        Raises:
            ValueError: The period is not positive.
        """
        if not 0.0 < period < math.inf:
            raise ValueError(f'period is {period} s: it must be above 0')
        self._period = period
        self._rest = rest
        self._wanted: T | None = None
        self._moved: T | None = None
        self._rests = 0  # still to be published
        self._due = -math.inf  # time of the next message

    @property
    def is_idle(self) -> bool:
        """Whether nothing is published until a command is wanted."""
        return self._wanted is None and self._rests == 0

    def is_rest(self, command: T) -> bool:
        """Return whether a command means rest."""
        return command == self._rest(command)

    def due(self) -> float:
        """Return the latest time for the next step(); infinite when idle."""
        return math.inf if self.is_idle else self._due

    def stop(self) -> None:
        """Publish rest commands even if nothing moves: the operator requested a stop."""
        self._wanted, self._rests, self._due = None, RESTS, -math.inf

    def end(self) -> None:
        """Publish rest commands at the end of the program, if it ever moved anything."""
        if self._moved is not None:
            self.stop()

    def step(self, wanted: T | None, now: float) -> T | None:
        """Return the command to publish now, or None; an inactive source passes None."""
        if wanted != self._wanted:
            if wanted is None:
                self._rests = RESTS
            self._wanted, self._due = wanted, now
        if self.is_idle or now < self._due:
            return None
        self._due = now + self._period
        if wanted is not None:
            self._rests, self._moved = 0, wanted
            return wanted
        self._rests -= 1
        return self._rest(self._moved)


class ProgramRequest(Enum):
    """Request of the operator to the program itself."""

    QUIT = auto()
    SUSPEND = auto()
    """Return the terminal to the shell for a while."""


class Robot(Protocol):
    """The commanded robot. Only flush() blocks."""

    say: Callable[[str], None]  # shows the person a message; the program sets it to its screen

    def publish(self, command: Any) -> None:  # noqa: ANN401  # what its mappings want
        """Publish a command."""

    def handle(self, request: Any, now: float) -> None:  # noqa: ANN401
        """Send a request of a mapping."""

    def serve(self, now: float) -> None:
        """Process answers, and send requests that are due."""

    def flush(self) -> None:
        """Wait until published messages have arrived, for a limited time."""


class TeleopMapping(ABC):
    """Maps the events of a source to commands and requests for a robot."""

    introduction = ''  # what a person at a terminal reads first

    def __init__(self, robot: Robot, stream: CommandStream[Any]) -> None:
        self.robot = robot  # who is commanded
        self._stream = stream

    @abstractmethod
    def feed(self, event: Any) -> Sequence[object]:  # noqa: ANN401  # of its source
        """Map an event of the source to the operator's requests."""

    @abstractmethod
    def wanted(self, now: float) -> object | None:
        """Return the wanted command; None without one."""

    def status(self, now: float) -> list[StatusPart]:  # of a program at a terminal
        """Return the parts of the status line, the most important first."""
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
    """Mapping of keys: a command lasts as long as its key is held."""

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
    """Mapping of a gamepad: a command lasts as long as the deadman is held.

    A motion ends when the gamepad has not changed for longer than a hand can hold it still; then
    the deadman must be released and pressed again.
    """

    def __init__(
        self,
        robot: Robot,
        deadman: Deadman,
        stream: CommandStream[Any],
        warn: Callable[[str], None] = lambda _: None,
    ) -> None:
        """Start idle; ``warn`` reports a motion that ends because the gamepad does not change."""
        super().__init__(robot, stream)
        self.state = AT_REST  # last state of the gamepad
        # whether a motion has ended so, and the deadman was not released since
        self.expired = False
        self._deadman = deadman
        self._warn = warn
        self._is_alive = True  # the gamepad has changed since the last step
        self._changed_at = 0.0

    @property
    def grip(self) -> Grip:
        """The motion that the operator permits now."""
        return Grip.RELEASED if self.expired else self._deadman.grip(self.state)

    def take(self, state: GamepadState) -> GamepadState:
        """Store a state of the gamepad (at rest without one); return the previous state."""
        before, self.state = self.state, state
        changed = state != before or state.changes != before.changes
        self._is_alive |= changed
        released = self._deadman.grip(state) is Grip.RELEASED
        if released or (changed and self._deadman.enable is None):
            self.expired = False
        return before

    def step(self, now: float) -> object | None:
        """Return the command to publish now; call it after every state and when it is due."""
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


LONGEST_WAIT = 0.1  # [s] for which answers of the robot and a signal may wait
RELEASE_WORDS = {
    ReleaseSource.TERMINAL: 'true releases',
    ReleaseSource.KEYBOARD: 'true releases (evdev)',
    ReleaseSource.TIME_OUT: 'timed releases',
}


class TeleopProgram:
    """Runs one operator and one robot in one thread; at any end, it commands the robot to rest.

    At a terminal it has a status line, and supports Ctrl-Z.
    """

    # serves the node of the program without waiting, in each turn of the loop
    spin: Callable[[], object] = staticmethod(lambda: None)

    def __init__(
        self, source: Keyboard | Gamepad, mapping: TeleopMapping, stop: threading.Event
    ) -> None:
        """Prepare.

        Args:
            source: The open input source.
            mapping: Maps the source to commands.
            stop: Ends the program.
        """
        self._source = source
        self._mapping = mapping
        self._robot = mapping.robot
        self._stop = stop
        self._keyboard = source if isinstance(source, Keyboard) else None
        self._line = self._keyboard.status_line() if self._keyboard is not None else None
        self._colour = not os.environ.get('NO_COLOR')  # https://no-color.org
        if self._line is not None:
            self._robot.say = self._line.message

    def run(self) -> None:
        """Run until the operator quits or ``stop`` is set.

        Raises:
            OperatorInputError: The source is lost.
        """
        if self._line is not None:
            self._line.message(self._mapping.introduction)
        try:
            while not self._stop.is_set():
                self._serve()
        finally:
            self._rest()

    def _serve(self) -> None:
        now = time.monotonic()
        wait = min(max(self._mapping.due(now) - now, 0.0), LONGEST_WAIT)
        for event in self._source.wait(wait):
            requests = self._mapping.feed(event)
            # at once: of a press and a release in one reading, both are published
            self._step()
            for request in requests:
                self._handle(request)
        self._step()
        self.spin()
        now = time.monotonic()
        self._robot.serve(now)
        self._show(now)

    def _step(self) -> None:
        command = self._mapping.step(time.monotonic())
        if command is not None:
            self._robot.publish(command)

    def _handle(self, request: object) -> None:
        match request:
            case str():
                self._robot.say(request)
            case ProgramRequest.QUIT:
                self._stop.set()
            case ProgramRequest.SUSPEND:
                self._suspend()
            case _:
                self._robot.handle(request, time.monotonic())

    def _suspend(self) -> None:
        if self._keyboard is not None:
            self._rest()
            with self._keyboard.paused():
                os.killpg(0, signal.SIGTSTP)  # goes on here after the shell's fg
            self._robot.say('going on')

    def _rest(self) -> None:
        """Publish the last rest commands, wait until they are sent, and keep the status line."""
        self._mapping.end()
        for _ in range(RESTS):
            self._step()
            now = time.monotonic()
            pause = self._mapping.due(now) - now
            if 0.0 < pause < LONGEST_WAIT:
                time.sleep(pause)
        self._robot.flush()
        if self._line is not None:
            self._show(time.monotonic())
            self._line.end()

    def _show(self, now: float) -> None:
        if self._keyboard is not None and self._line is not None:
            release = RELEASE_WORDS[self._keyboard.release_source], Style.DIM
            parts = [*self._mapping.status(now), release]
            self._line.show(status_text(parts, colour=self._colour))
