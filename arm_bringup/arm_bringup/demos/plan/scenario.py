# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Runs the demo beside the supervisor: boot, enable, pick and place again and again, stop."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import itertools
import math
import time

from demo_runner import DemoResult, DemoScenario, Display
from process_supervisor import CallError

from ...enabling import enabling_services
from ..figures import Figures
from ..report import bus_line, warnings
from .orders import PlanningClient
from .results import Results
from .sequence import EndRequested, PlanSequence

ENABLE_TIMEOUT = 15.0
"""Longest time in [s] for all drives to be enabled, and for them to be in their mode."""


class PlanScenario(DemoScenario[PlanningClient]):
    """Has arms pick and place among obstacles."""

    opening = 'booting'

    def __init__(
        self,
        display: Display[Figures],
        joints: Sequence[str],
        mode_service: str,
        make_sequence: Callable[[PlanningClient, Results], PlanSequence],
        duration: float | None,
    ) -> None:
        """Prepare; nothing happens yet.

        Args:
            display: Where it is shown.
            joints: Names of the joints with a drive.
            mode_service: Service of a drive that selects the mode of streams.
            make_sequence: Makes what is done.
            duration: How long it is repeated in [s]; None until :meth:`leave`.
        """
        super().__init__(display)
        self._enabling = enabling_services(joints, mode_service)
        self._make_sequence = make_sequence
        self._duration = math.inf if duration is None else duration

    def _prepare(self, client: PlanningClient) -> None:
        client.prepare(itertools.chain(*self._enabling))

    def _perform(self, client: PlanningClient) -> None:
        self._enter('enabling')
        for services in self._enabling:
            client.call(services, ENABLE_TIMEOUT)
        self._moving.set()
        results = Results()
        sequence = self._make_sequence(client, results)
        sequence.enter, sequence.look = self._enter, lambda: self._look(client)
        try:
            self._repeat(sequence, results)
        except EndRequested:
            self._enter('leaving')
            sequence.come_to_rest()
        except CallError as error:
            results.problems.append(str(error))
        results.add('planning', results.planned())
        results.add('bus and loop', bus_line(client.figures.bus))
        self.result = DemoResult(results.lines(), results.problems, warnings(client.figures))

    def _repeat(self, sequence: PlanSequence, results: Results) -> None:
        """Run everything until the time is over, once at least."""
        begun = time.monotonic()
        sequence.set_up()
        while True:
            lap = time.monotonic()
            sequence.run()
            now = time.monotonic()
            if now + (now - lap) > begun + self._duration or results.problems:
                return  # another one would take longer, or hide what went wrong
            results.rows.clear()

    def _look(self, client: PlanningClient) -> None:
        self._show(client)
        if self.left:
            raise EndRequested
