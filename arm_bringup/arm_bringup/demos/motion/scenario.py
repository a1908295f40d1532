# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs the demo beside the supervisor: boot, enable, the motions again and again, stop."""

from __future__ import annotations

from collections.abc import Sequence
import itertools
import math
import time

from arm_model import Array, RobotModel
from demo_runner import DemoResult, DemoScenario, Display
from process_supervisor import CallError

from ...enabling import enabling_services
from ..figures import Figures
from ..report import warnings
from .client import MotionClient
from .results import Results
from .sequence import EndRequested, MotionSequence

ENABLE_TIMEOUT = 15.0
"""Longest time in [s] for all drives to be enabled, and for them to be in their mode."""


class MotionScenario(DemoScenario[MotionClient]):
    """Jogs an arm and sends it trajectories."""

    opening = 'booting'

    def __init__(
        self,
        display: Display[Figures],
        joints: Sequence[str],
        mode_service: str,
        *,
        model: RobotModel,
        start: Array,
        period: float,
        duration: float | None,
    ) -> None:
        """Prepare; nothing happens yet.

        Args:
            display: Where it is shown.
            joints: Names of the joints with a drive.
            mode_service: Service of a drive that selects the mode of streams.
            model: The arm.
            start: The pose from which it begins in [rad].
            period: Period of the cycle in [s].
            duration: How long it is repeated in [s]; None until :meth:`leave`.
        """
        super().__init__(display)
        self._enabling = enabling_services(joints, mode_service)
        self._model, self._start, self._period = model, start, period
        self._duration = math.inf if duration is None else duration

    def _prepare(self, client: MotionClient) -> None:
        client.prepare(itertools.chain(*self._enabling))

    def _perform(self, client: MotionClient) -> None:
        self._enter('enabling')
        for services in self._enabling:
            client.call(services, ENABLE_TIMEOUT)
        self._moving.set()
        results = Results()
        sequence = MotionSequence(
            client,
            self._model,
            self._start,
            self._period,
            results,
            self._enter,
            lambda: self._look(client),
        )
        try:
            self._repeat(sequence)
        except EndRequested:
            self._enter('leaving')
        except CallError as error:
            results.problems.append(str(error))
        if client.samples:
            sequence.measure()
        self.result = DemoResult(
            results.lines(), results.problems, [*warnings(client.figures), *self._hold_ups(client)]
        )

    def _hold_ups(self, client: MotionClient) -> list[str]:
        jitter = client.figures.bus.jitter_p99
        if math.isnan(jitter) or jitter <= self._period / 2:
            return []
        late = f'the cycle was late by {1e3 * jitter:.0f} ms now and then (p99)'
        return [f'{late}: this computer is too busy, drives wait and may lose their path']

    def _repeat(self, sequence: MotionSequence) -> None:
        """Run the motions until the time is over, once at least."""
        begun = time.monotonic()
        while True:
            lap = time.monotonic()
            sequence.run()
            now = time.monotonic()
            if now + (now - lap) > begun + self._duration:
                return  # another one would take longer
            sequence.results.rows.clear()

    def _look(self, client: MotionClient) -> None:
        self._show(client)
        if self.left:
            raise EndRequested
