# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The course of the demo: boot, enable, wave, watch, stop."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import math
import time
from typing import Protocol

from process_supervisor import play
from process_supervisor.display import Display

from ..figures import Figures
from ..report import problems, summary_lines, warnings

ENABLE_TIMEOUT = 15.0
"""Longest time in [s] for all drives to be enabled."""
CALL_TIMEOUT = 10.0
"""Longest time in [s] for other services."""


class Client(play.Client, Protocol):
    """What the demo needs of ROS; :class:`..client.ArmClient` is the real one."""

    figures: Figures

    def prepare(self, services: Iterable[str]) -> None:
        """Look for services that will be called."""

    def call(self, services: list[str], timeout: float) -> dict[str, str]:
        """Call services side by side."""


class Play(play.Play[Client]):
    """Lets the arm wave."""

    opening = 'booting'

    def __init__(
        self,
        joints: Sequence[str],
        mode_service: str,
        display: Display[Figures],
        duration: float | None,
    ) -> None:
        """Prepare; nothing happens yet.

        Args:
            joints: Names of the joints with a drive.
            mode_service: Service of a drive that selects the mode of the wave.
            display: Where it is shown.
            duration: How long the wave runs in [s]; None until :meth:`leave`.
        """
        super().__init__(display)
        self._joints = list(joints)
        self._mode_service = mode_service
        self._duration = math.inf if duration is None else duration

    def _course(self, client: Client, ready: Callable[[], bool]) -> None:
        init, mode, wave = self._services()
        client.prepare([*init, *mode, *wave])
        client.wait_until(lambda: self._booted(client, ready), math.inf, 'the processes')
        self._enter('enabling')
        client.call(init, ENABLE_TIMEOUT)
        client.call(mode, CALL_TIMEOUT)
        client.call(wave[:1], CALL_TIMEOUT)
        self._enter('waving')
        begun = time.monotonic()
        self._moving.set()
        end = begun + self._duration
        client.wait_until(lambda: self._seen_enough(client, end), math.inf, 'the end')
        self._conclude(client.figures, time.monotonic() - begun)
        self._enter('stopping')
        client.call(wave[1:], CALL_TIMEOUT)
        client.wait_until(lambda: self._stands_still(client), CALL_TIMEOUT, 'the wave to stop')

    def _services(self) -> tuple[list[str], list[str], list[str]]:
        init = [f'{joint}/init' for joint in self._joints]
        mode = [f'{joint}/{self._mode_service}' for joint in self._joints]
        return init, mode, ['wave/start', 'wave/stop']

    def _booted(self, client: Client, ready: Callable[[], bool]) -> bool:
        self._show(client)
        return ready()

    def _seen_enough(self, client: Client, end: float) -> bool:
        self._show(client)
        return self.left or time.monotonic() >= end

    def _stands_still(self, client: Client) -> bool:
        self._show(client)
        return client.figures.wave == 'idle'

    def _conclude(self, figures: Figures, duration: float) -> None:
        self.result = play.Result(
            summary_lines(figures, self._joints, duration),
            problems(figures, self._joints),
            warnings(figures),
        )
