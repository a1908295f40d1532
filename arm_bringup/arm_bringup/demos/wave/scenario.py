# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scenario of the demo: boot, enable, wave, watch, stop."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
import itertools
import math
import time
from typing import Protocol

from urdf_reader import JointRange

from demo_runner import DemoClient, DemoResult, DemoScenario, Display
from process_supervisor import Notice, Severity

from ...enabling import enabling_services
from ..figures import Figures
from ..report import problems, summary_lines, warnings

ENABLE_TIMEOUT = 15.0
"""Longest time in [s] for all drives to be enabled, and for them to be in their mode."""
HALT_TIMEOUT = 10.0
"""Longest time in [s] for the drives to come to rest."""


class Client(DemoClient, Protocol):
    """What the demo needs of ROS; :class:`.client.WaveClient` is the real one."""

    figures: Figures

    def prepare(self, services: Iterable[str]) -> None:
        """Look for services that will be called."""

    def call(self, services: list[str], timeout: float) -> dict[str, str]:
        """Call services side by side."""

    def start_wave(self) -> None:
        """Stream targets to the drives that can follow."""

    def stop_wave(self) -> Sequence[str]:
        """Stream none any more; return the drives that were in the wave."""

    def departures(self) -> Sequence[str]:
        """Return which drives have left the wave, and why."""


class WaveScenario(DemoScenario[Client]):
    """Lets the arm wave."""

    opening = 'booting'

    def __init__(
        self,
        display: Display[Figures],
        joints: Mapping[str, JointRange],
        mode_service: str,
        duration: float | None,
    ) -> None:
        """Prepare; nothing happens yet.

        Args:
            display: Where it is shown.
            joints: The joints with a drive.
            mode_service: Service of a drive that selects the mode of the wave.
            duration: How long the wave runs in [s]; None until :meth:`leave`.
        """
        super().__init__(display)
        self._joints = joints
        self._enabling = enabling_services(list(joints), mode_service)
        self._duration = math.inf if duration is None else duration

    def _prepare(self, client: Client) -> None:
        halts = [f'{name}/halt' for name in self._joints]
        client.prepare([*itertools.chain(*self._enabling), *halts])

    def _perform(self, client: Client) -> None:
        self._enter('enabling')
        for services in self._enabling:
            client.call(services, ENABLE_TIMEOUT)
        client.start_wave()
        self._enter('waving')
        begun = time.monotonic()
        self._moving.set()
        end = begun + self._duration
        self._wait(client, lambda: self._ends(client, end), math.inf, 'the end')
        self._conclude(client.figures, time.monotonic() - begun)
        self._enter('stopping')
        if halts := [f'{name}/halt' for name in client.stop_wave()]:
            client.call(halts, HALT_TIMEOUT)

    def _ends(self, client: Client, end: float) -> bool:
        """Report who left the wave; return whether it ends."""
        for text in client.departures():
            self._display.notice(Notice(Severity.WARNING, text))
        return self.left or time.monotonic() >= end

    def _conclude(self, figures: Figures, duration: float) -> None:
        self.result = DemoResult(
            summary_lines(figures, self._joints, duration),
            problems(figures, self._joints),
            warnings(figures),
        )
