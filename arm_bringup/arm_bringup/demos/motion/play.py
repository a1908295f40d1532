# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs the demo beside the supervisor: boot, enable, the course again and again, stop."""

from __future__ import annotations

from collections.abc import Callable
import math
import time

from arm_model import RobotModel
from process_supervisor import CallError
from process_supervisor.play import Result

from ..report import warnings
from ..wave.play import CALL_TIMEOUT, Client, ENABLE_TIMEOUT, Play
from .client import MotionClient
from .course import Course, Left
from .results import Results


class MotionPlay(Play):
    """The demo in a thread of its own.

    Attributes:
        model: The arm; set before it is run.
        period: Period of the cycle in [s]; set before it is run.
    """

    model: RobotModel
    period: float

    def _course(self, client: Client, ready: Callable[[], bool]) -> None:
        if not isinstance(client, MotionClient):
            raise TypeError(f'{client!r} cannot move an arm')
        init, mode, _ = self._services()
        client.prepare([*init, *mode])
        client.wait_until(lambda: self._booted(client, ready), math.inf, 'the processes')
        self._enter('enabling')
        client.call(init, ENABLE_TIMEOUT)
        client.call(mode, CALL_TIMEOUT)
        self._moving.set()
        results = Results()
        course = Course(
            client, self.model, self.period, results, self._enter, lambda: self._look(client)
        )
        try:
            self._repeat(course)
        except Left:
            self._enter('leaving')
        except CallError as error:
            results.problems.append(str(error))
        if client.samples:
            course.measure()
        self.result = Result(
            results.lines(), results.problems, [*warnings(client.figures), *self._hold_ups(client)]
        )

    def _hold_ups(self, client: MotionClient) -> list[str]:
        jitter = client.figures.bus.jitter_p99
        if math.isnan(jitter) or jitter <= self.period / 2:
            return []
        late = f'the cycle was late by {1e3 * jitter:.0f} ms now and then (p99)'
        return [f'{late}: this computer is too busy, drives wait and may lose their path']

    def _repeat(self, course: Course) -> None:
        """Run the course until the time is over, once at least."""
        begun = time.monotonic()
        while True:
            lap = time.monotonic()
            course.run()
            now = time.monotonic()
            if now + (now - lap) > begun + self._duration:
                return  # another one would take longer
            course.results.rows.clear()

    def _look(self, client: MotionClient) -> None:
        self._show(client)
        if self.left:
            raise Left
