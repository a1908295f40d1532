# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The loop of a program with which a person moves a robot: reads, publishes, and ends at rest."""

from __future__ import annotations

from collections.abc import Callable
import os
import signal
import threading
import time

from .command_stream import RESTS
from .gamepad import Gamepad
from .keyboard import Keyboard, ReleaseSource
from .mapping import ProgramRequest, TeleopMapping
from .status import status_text, Style

LONGEST_WAIT = 0.1  # [s] for which answers of the robot and a signal may wait
RELEASE_WORDS = {
    ReleaseSource.TERMINAL: 'true releases',
    ReleaseSource.KEYBOARD: 'true releases (evdev)',
    ReleaseSource.TIME_OUT: 'timed releases',
}


class TeleopProgram:
    """One person and one robot, in one thread; whatever ends it, the robot gets commands to rest.

    At a terminal it has a status line, and Ctrl-Z.

    Attributes:
        spin: Serves the node of the program without waiting, in each turn of the loop.
    """

    spin: Callable[[], object] = staticmethod(lambda: None)

    def __init__(
        self, source: Keyboard | Gamepad, mapping: TeleopMapping, stop: threading.Event
    ) -> None:
        """Prepare.

        Args:
            source: What is read; open.
            mapping: What it means to the robot.
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
        """Serve until the person quits or the event is set.

        Raises:
            OperatorInputError: The source is gone.
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
        """Publish the last rests, see them off, and leave the line as the last thing shown."""
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
