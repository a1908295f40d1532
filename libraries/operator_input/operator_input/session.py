# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The loop of a program with which a person moves a robot: reads, publishes, and ends at rest."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
import threading
import time
from typing import Generic, Protocol, TypeVar

from .command_stream import RESTS

LONGEST_WAIT = 0.1  # [s] for which answers of the robot and a signal may wait

Command = TypeVar('Command')
Command_co = TypeVar('Command_co', covariant=True)


class Teleop(Protocol[Command_co]):
    """Decides what to publish; pure, time is handed in."""

    def step(self, now: float) -> Command_co | None:
        """Return what to publish now; None for nothing."""

    def due(self, now: float) -> float:
        """Return when step() has to be called at the latest [s]; may be infinite."""

    def end(self) -> None:
        """Let go of everything at the end of the program."""


class Session(ABC, Generic[Command]):
    """One person and one robot, in one thread; whatever ends it, the robot gets commands to rest.

    Subclasses read from somewhere and publish to someone.

    Attributes:
        spin: Serves the node of the program without waiting, before each :meth:`attend`.
    """

    spin: Callable[[], object] = staticmethod(lambda: None)

    def __init__(self, teleop: Teleop[Command], stop: threading.Event) -> None:
        """Prepare.

        Args:
            teleop: Decides what to publish.
            stop: Ends it.
        """
        self._moves = teleop
        self._stop = stop

    def run(self) -> None:
        """Serve until the person quits or the event is set.

        Raises:
            OperatorInputError: What is read from is gone.
        """
        self.begin()
        try:
            while not self._stop.is_set():
                self.serve()
        finally:
            self.end()

    @abstractmethod
    def begin(self) -> None:
        """Show the introduction."""

    @abstractmethod
    def serve(self) -> None:
        """Read for :data:`LONGEST_WAIT` at most, and publish what is due."""

    @abstractmethod
    def publish(self, command: Command) -> None:
        """Publish a command to the robot."""

    @abstractmethod
    def attend(self, now: float) -> None:
        """Process answers of the robot and send requests to it, without waiting.

        Args:
            now: Time [s].
        """

    @abstractmethod
    def flush(self) -> None:
        """Wait until what was published has arrived, for a while at most."""

    def end(self) -> None:
        """Publish the last rests, and see them off."""
        self._moves.end()
        for _ in range(RESTS):
            now = time.monotonic()
            self.step(now)
            pause = self._moves.due(now) - now
            if 0.0 < pause < LONGEST_WAIT:
                time.sleep(pause)
        self.flush()

    def step(self, now: float) -> None:
        """Publish what is wanted at a time [s]."""
        command = self._moves.step(now)
        if command is not None:
            self.publish(command)
