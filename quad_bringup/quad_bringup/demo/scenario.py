# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scenario of the demo: stand up, walk, turn, strafe, stop, lie down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math
import time
from typing import Protocol

from demo_runner import DemoClient, DemoResult, DemoScenario, Display
from process_supervisor import CallError

from .figures import Figures
from .report import Measured, problems, summary_lines
from .segments import Segment, segments, STANDSTILL, Velocity
from .track import mean_velocity, Milestone

FIND_TIMEOUT = 20.0
"""Longest time in [s] for the demo's node and the others to find each other."""
MODE_TIMEOUT = 15.0
"""Longest time in [s] for a mode to be reached."""
KEPT_SEGMENTS = 40
"""How many segments a demo without end remembers for its summary."""


@dataclass(frozen=True, slots=True)
class Milestones:
    """What the body has covered, as two sources report it; None without a report.

    Attributes:
        measured: The simulator.
        odometry: /odom.
    """

    measured: Milestone | None
    odometry: Milestone | None


class Client(DemoClient, Protocol):
    """What the demo needs of ROS; :class:`.client.QuadClient` is the real one."""

    @property
    def figures(self) -> Figures:
        """What was received last."""

    @property
    def milestones(self) -> Milestones:
        """What the body has covered so far."""

    @property
    def missing(self) -> list[str]:
        """What is needed and not there yet."""

    def command(self, velocity: Velocity | None) -> None:
        """Command a velocity from now on, again and again; None to be silent."""

    def watch_tilt(self) -> None:
        """Measure the greatest tilt from now on."""

    def set_mode(self, mode: str, timeout: float) -> str:
        """Request a mode; return the answer."""


class WalkScenario(DemoScenario[Client]):
    """Lets the robot walk."""

    def __init__(
        self, display: Display[Figures], mode: str, duration: float | None, share: float = 1.0
    ) -> None:
        """Prepare; nothing happens yet.

        Args:
            display: Where it is shown.
            mode: Mode in which it walks.
            duration: How long it walks in [s]; None until :meth:`leave`.
            share: Of the velocities of a trot.
        """
        super().__init__(display)
        self._share = share
        self._mode = mode
        self._duration = duration
        self._measured: list[Measured] = []

    def _perform(self, client: Client) -> None:
        self._find(client)
        self._reach(client, 'stand', 'standing up')
        self._moving.set()
        client.watch_tilt()
        self._reach(client, self._mode, self._mode)
        for segment in segments(self._duration, self._share):
            if self.left:
                break
            self._go(client, segment)
        self._conclude(client.figures)
        client.command(STANDSTILL)
        self._reach(client, 'lie', 'lying down')
        client.command(None)

    def _find(self, client: Client) -> None:
        """Wait until the client and the processes have found each other."""
        try:
            self._wait(client, lambda: not client.missing, FIND_TIMEOUT, 'the topics')
        except CallError as error:
            if not client.missing:
                raise
            raise CallError(
                f'not found in {FIND_TIMEOUT:g} s: {", ".join(client.missing)}'
            ) from error

    def _reach(self, client: Client, mode: str, phase: str) -> None:
        """Request a mode and wait until it is there."""
        self._enter(phase)
        client.set_mode(mode, MODE_TIMEOUT)
        self._wait(client, lambda: client.figures.state == mode, MODE_TIMEOUT, f'mode {mode}')

    def _go(self, client: Client, segment: Segment) -> None:
        """Command the velocity of a segment, and measure what comes of it."""
        self._enter(segment.name)
        client.command(segment.velocity)
        begin = time.monotonic()
        self._wait_for_time(client, begin + segment.settling)
        before = client.milestones
        self._wait_for_time(client, begin + segment.duration)
        after = client.milestones
        if self.left:
            return  # cut short: that is no measurement
        measured = Measured(
            segment,
            _between(before.measured, after.measured),
            _between(before.odometry, after.odometry),
        )
        self._measured = [*self._measured, measured][-KEPT_SEGMENTS:]

    def _wait_for_time(self, client: Client, end: float) -> None:
        self._wait(client, lambda: self.left or time.monotonic() >= end, math.inf, 'the time')

    def _wait(
        self, client: Client, condition: Callable[[], bool], timeout: float, what: str
    ) -> None:
        """Wait for something while the figures are shown; a fault of the controller ends it."""

        def reached() -> bool:
            if client.figures.fault:
                self._conclude(client.figures)
                raise CallError(f'the controller is in a fault: {client.figures.fault}')
            return condition()

        super()._wait(client, reached, timeout, what)

    def _conclude(self, figures: Figures) -> None:
        if self._measured:
            self.result = DemoResult(
                summary_lines(figures, self._measured), problems(figures, self._measured)
            )

    def _accompany(self, client: Client, stopped: Callable[[], bool]) -> None:
        client.command(None)
        super()._accompany(client, stopped)


def _between(begin: Milestone | None, end: Milestone | None) -> Velocity | None:
    return None if begin is None or end is None else mean_velocity(begin, end)
