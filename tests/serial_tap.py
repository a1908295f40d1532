# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A serial cable with a listener: what the bridge sends to the servos, as the wire has it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from dataclasses import dataclass
import itertools
import os
from pathlib import Path
import random
import select
import termios
import threading
import time
import tty
from typing import TYPE_CHECKING

from quad_hardware.protocol import (
    Code,
    Frame,
    HOST_KINDS,
    Kind,
    ROBOT_KINDS,
    StreamParser,
    V2,
)

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self

PERIOD = 0.02
"""Time between two commands in [s]."""
POLL = 0.05
"""Longest time in [s] after which the line looks whether it is cut, or has another baud rate."""
SPEEDS = slice(4, 6)
"""Input and output speed in what tcgetattr returns."""


@dataclass(frozen=True)
class Target:
    """A servo command on the wire.

    Attributes:
        time: Steady time of its arrival in [s].
        angles: Angles in [deg] by motor id.
    """

    time: float
    angles: dict[int, float]


class SerialTap:
    """Sits between the bridge and the robot's port; the bridge opens :attr:`link`.

    Attributes:
        link: Path of the bridge's end.
        targets: What the bridge sent to the servos so far (the protocol that pushes states).
        reports: Steady times in [s] at which the robot's states had come in.
        noise: Share of the bytes, of both directions, in which a bit is inverted from now on.
    """

    def __init__(self, link: Path, robot: Path) -> None:
        """Connect the ends.

        Args:
            link: Where the bridge shall find its end.
            robot: The robot's port.
        """
        self.link = link
        self.targets: list[Target] = []
        self.reports: list[float] = []
        self.noise = 0.0
        self._chance = random.Random(0)
        self._host, self._pushed = (StreamParser(V2, k) for k in (HOST_KINDS, ROBOT_KINDS))
        self._robot = os.open(robot, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        self._bridge, self._far = os.openpty()
        for end in (self._robot, self._far):
            tty.setraw(end)
        os.set_blocking(self._bridge, False)
        link.symlink_to(os.ttyname(self._far))
        self._closing = threading.Event()
        self._thread = threading.Thread(target=self._run, name='tap')
        self._thread.start()

    @property
    def thread_id(self) -> int:
        """The system's id of the thread that passes the bytes on."""
        return self._thread.native_id or 0

    def seed(self, number: int) -> None:
        """Say which bytes the noise hits."""
        self._chance.seed(number)

    def forget(self) -> None:
        """Begin anew with nothing seen."""
        self.targets, self.reports = [], []

    def largest_step(self, since: float = 0.0) -> float:
        """Return the largest change of a servo's target between two commands in [deg].

        Args:
            since: Steady time in [s] from which on steps count.
        """
        return max(self._steps(since), default=0.0)

    def longest_silence(self, since: float) -> float:
        """Return the longest time in [s] in which the bridge received no state of the robot.

        Args:
            since: Steady time in [s] at which the first silence begins at the earliest.
        """
        arrivals = (report for report in list(self.reports) if report > since)
        times = [since, *arrivals, time.monotonic()]
        return max(after - before for before, after in itertools.pairwise(times))

    def _steps(self, since: float) -> Iterator[float]:
        for before, after in itertools.pairwise(list(self.targets)):
            if after.time >= since:
                # a busy bridge sends the newest command instead of one that still waits
                periods = 2 if 1.5 < (after.time - before.time) / PERIOD < 2.5 else 1
                for motor in before.angles.keys() & after.angles.keys():
                    yield abs(after.angles[motor] - before.angles[motor]) / periods

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Pull the cable."""
        self._closing.set()
        self._thread.join()
        for end in (self._robot, self._bridge, self._far):
            os.close(end)
        self.link.unlink()

    def _run(self) -> None:
        while not self._closing.is_set():
            self._pass_speed_on()
            ready, _, _ = select.select([self._robot, self._bridge], [], [], POLL)
            if self._bridge in ready:
                data = _receive(self._bridge)
                for frame in self._host.feed(data):
                    self._take(frame)
                _send(self._robot, self._disturbed(data))
            if self._robot in ready:
                data = _receive(self._robot)
                frames = self._pushed.feed(data)
                self.reports += [time.monotonic() for each in frames if each.kind is Kind.PUSH]
                _send(self._bridge, self._disturbed(data))

    def _disturbed(self, data: bytes) -> bytes:
        if not (noise := self.noise):
            return data
        chance = self._chance
        return bytes(b ^ 1 << chance.randrange(8) if chance.random() < noise else b for b in data)

    def _pass_speed_on(self) -> None:
        wanted, there = termios.tcgetattr(self._far), termios.tcgetattr(self._robot)
        if wanted[SPEEDS] != there[SPEEDS]:
            there[SPEEDS] = wanted[SPEEDS]
            termios.tcsetattr(self._robot, termios.TCSANOW, there)

    def _take(self, frame: Frame) -> None:
        if frame.address == Code.SERVOS:
            fields = V2.functions[Code.SERVOS].unpack(frame.payload)
            motors = (round(motor) for motor in fields['motor'])
            angles = dict(zip(motors, fields['angle'], strict=True))
            self.targets.append(Target(time.monotonic(), angles))


def _receive(end: int) -> bytes:
    """Read from a line; what was announced may be flushed away by a change of speed."""
    with suppress(BlockingIOError):
        return os.read(end, 4096)
    return b''


def _send(end: int, data: bytes) -> None:
    """Write to a line; what is not read is dropped."""
    with suppress(BlockingIOError):
        os.write(end, data)
