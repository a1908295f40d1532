# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The scenario of the demo: boot, enable, wave, watch, stop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
import time
from typing import Protocol

from urdf_reader import JointRange

from demo_runner import DemoResult, Display
from process_supervisor import Notice, Severity

from ..figures import Figures
from ..report import problems, summary_lines, warnings
from ..scenario import ArmScenario, DriveClient

HALT_TIMEOUT = 10.0
"""Longest time in [s] for the drives to come to rest."""


class Client(DriveClient, Protocol):
    """What the demo needs of ROS; :class:`.client.WaveClient` is the real one."""

    def start_wave(self) -> None:
        """Stream targets to the drives that can follow."""

    def stop_wave(self) -> Sequence[str]:
        """Stream none any more; return the drives that were in the wave."""

    def departures(self) -> Sequence[str]:
        """Return which drives have left the wave, and why."""


class WaveScenario(ArmScenario[Client]):
    """Lets the arm wave."""

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
        super().__init__(display, joints, mode_service, duration)
        self._joints = joints

    @property
    def _others(self) -> Sequence[str]:
        return _halts(list(self._joints))

    def _move(self, client: Client) -> None:
        client.start_wave()
        self._enter('waving')
        begun = time.monotonic()
        end = begun + self._duration
        self._wait(client, lambda: self._ends(client, end), math.inf, 'the end')
        self._conclude(client.figures, time.monotonic() - begun)
        self._enter('stopping')
        if active := client.stop_wave():
            client.call(_halts(active), HALT_TIMEOUT)

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


def _halts(names: Sequence[str]) -> list[str]:
    return [f'{name}/halt' for name in names]
