# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One person at one terminal."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Iterable
import os
import signal
import threading
import time
from typing import Generic, Protocol, TypeVar

from .keyboard import Keyboard
from .keys import KeyEvent
from .requests import Note, Quit, Suspend
from .session import Command, Command_co, LONGEST_WAIT, Session, Teleop
from .terminal import StatusLine

Request = TypeVar('Request')
Request_co = TypeVar('Request_co', covariant=True)


class KeyTeleop(Teleop[Command_co], Protocol[Command_co, Request_co]):
    """Maps keys to commands and requests."""

    def feed(self, event: KeyEvent) -> Iterable[Request_co]:
        """Take what happened to a key; return the person's requests besides motion."""


class KeyboardSession(Session[Command], Generic[Command, Request]):
    """Keys, a status line, and Ctrl-Z.

    Attributes:
        keyboard: What is read.
        line: Where messages and the status are shown.
        colour: Whether the person likes colours (https://no-color.org).
    """

    def __init__(
        self,
        keyboard: Keyboard,
        teleop: KeyTeleop[Command, Request],
        introduction: str,
        stop: threading.Event,
    ) -> None:
        """Prepare.

        Args:
            keyboard: Open keyboard.
            teleop: Maps keys to commands and requests.
            introduction: What the person reads first.
            stop: Ends it.
        """
        super().__init__(teleop, stop)
        self.keyboard = keyboard
        self.line: StatusLine = keyboard.status_line()
        self.colour = not os.environ.get('NO_COLOR')
        self._keys = teleop
        self._introduction = introduction

    @abstractmethod
    def handle(self, request: Request) -> None:
        """Handle a request besides motion."""

    @abstractmethod
    def show(self, now: float) -> None:
        """Show on the line how it is.

        Args:
            now: Time [s].
        """

    def begin(self) -> None:
        """Show which keys there are."""
        self.line.message(self._introduction)

    def serve(self) -> None:
        """Wait for keys, publish, show."""
        now = time.monotonic()
        for event in self.keyboard.wait(min(self._moves.due(now) - now, LONGEST_WAIT)):
            requests = self._keys.feed(event)
            # at once: of a press and a release in one reading, both are published
            self.step(event.time)
            for request in requests:
                self._do(request)
        now = time.monotonic()
        self.step(now)
        self.spin()
        self.attend(now)
        self.show(now)

    def end(self) -> None:
        """Publish the last rests, and leave the line as the last thing that was shown."""
        super().end()
        self.show(time.monotonic())
        self.line.end()

    def _do(self, request: Request) -> None:
        match request:
            case Note(text):
                self.line.message(text)
            case Quit():
                self._stop.set()
            case Suspend():
                self._suspend()
            case _:
                self.handle(request)

    def _suspend(self) -> None:
        self.end()
        with self.keyboard.paused():
            os.killpg(0, signal.SIGTSTP)  # goes on here after the shell's fg
        self.line.message('going on')
