# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The course of the demo: boot, enable, wave, watch, stop."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
import math
import threading
import time
from typing import Protocol

from process_supervisor import Outcome, Phase
from process_supervisor.display import Display

from ..exceptions import CallError, GivenUpError
from .figures import Figures
from .report import problems, summary_lines, warnings

REFRESH = 0.2
"""Time between two pictures in [s]."""
ENABLE_TIMEOUT = 15.0
"""Longest time in [s] for all drives to be enabled."""
CALL_TIMEOUT = 10.0
"""Longest time in [s] for other services."""


@dataclass(frozen=True, slots=True)
class Result:
    """How a demo went.

    Attributes:
        summary: The lines of its summary, empty when it did not get as far as the wave.
        problems: What went wrong.
        warnings: What is worth a look.
    """

    summary: list[str]
    problems: list[str]
    warnings: list[str]


class Client(Protocol):
    """What the demo needs of ROS; :class:`.client.ArmClient` is the real one."""

    figures: Figures

    def prepare(self, services: Iterable[str]) -> None:
        """Look for services that will be called."""

    def call(self, services: list[str], timeout: float) -> dict[str, str]:
        """Call services side by side."""

    def wait_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait for something."""

    def listen(self, duration: float) -> None:
        """Hear what comes in."""

    def close(self) -> None:
        """Leave the ROS graph."""


MakeClient = Callable[[Callable[[], bool]], Client]
"""Joins the ROS graph; the client asks the argument whether its waiting shall be given up."""


class Supervisor(Protocol):
    """What the demo needs of the supervisor of its processes."""

    @property
    def phase(self) -> Phase:
        """What it is doing."""

    def stop(self, outcome: Outcome) -> None:
        """Ask for an orderly end."""


class Play:
    """Runs the demo in a thread of its own, beside the supervisor.

    Attributes:
        result: How it went, when the thread has ended.
    """

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
        self.result = Result([], [], [])
        self._joints = list(joints)
        self._mode_service = mode_service
        self._display = display
        self._duration = math.inf if duration is None else duration
        self._leaving = threading.Event()
        self._waving = threading.Event()
        self._next_picture = 0.0
        self._phase = ''

    @property
    def left(self) -> bool:
        """The user asked for the end."""
        return self._leaving.is_set()

    def leave(self) -> bool:
        """Ask for the end, from any thread.

        Returns:
            True when the wave runs: then it is stopped first.
        """
        self._leaving.set()
        return self._waving.is_set()

    def run(self, supervisor: Supervisor, make_client: MakeClient) -> None:
        """Run until the end, and stop the supervisor then.

        Args:
            supervisor: About to be run in the main thread.
            make_client: Makes the demo's ROS client, here in this thread.
        """
        ended = {Phase.STOPPING, Phase.STOPPED}
        client: Client | None = None
        try:
            client = make_client(lambda: supervisor.phase in ended)
            self._course(client, lambda: supervisor.phase is Phase.RUNNING)
            supervisor.stop(Outcome(0, 'the demo has ended'))
        except GivenUpError:
            pass  # the supervisor knows why
        except CallError as error:
            supervisor.stop(Outcome(1, str(error)))
        except Exception as error:
            supervisor.stop(Outcome(1, f'{type(error).__name__}: {error}'))
            raise
        finally:
            if client is not None:
                self._accompany(client, lambda: supervisor.phase is Phase.STOPPED)

    def _course(self, client: Client, ready: Callable[[], bool]) -> None:
        init, mode, wave = self._services()
        client.prepare([*init, *mode, *wave])
        self._enter('booting')
        client.wait_until(lambda: self._booted(client, ready), math.inf, 'the processes')
        self._enter('enabling')
        client.call(init, ENABLE_TIMEOUT)
        client.call(mode, CALL_TIMEOUT)
        client.call(wave[:1], CALL_TIMEOUT)
        self._enter('waving')
        begun = time.monotonic()
        self._waving.set()
        end = begun + self._duration
        client.wait_until(lambda: self._seen_enough(client, end), math.inf, 'the end')
        self._conclude(client.figures, time.monotonic() - begun)
        self._enter('stopping')
        client.call(wave[1:], CALL_TIMEOUT)
        client.wait_until(lambda: self._stands_still(client), CALL_TIMEOUT, 'the wave to stop')

    def _enter(self, phase: str) -> None:
        if phase != self._phase:
            self._phase = phase
            self._display.phase(phase)

    def _services(self) -> tuple[list[str], list[str], list[str]]:
        init = [f'/{joint}/init' for joint in self._joints]
        mode = [f'/{joint}/{self._mode_service}' for joint in self._joints]
        return init, mode, ['/wave/start', '/wave/stop']

    def _booted(self, client: Client, ready: Callable[[], bool]) -> bool:
        self._show(client)
        return ready()

    def _seen_enough(self, client: Client, end: float) -> bool:
        self._show(client)
        return self._leaving.is_set() or time.monotonic() >= end

    def _stands_still(self, client: Client) -> bool:
        self._show(client)
        return client.figures.wave == 'idle'

    def _show(self, client: Client) -> None:
        now = time.monotonic()
        if now >= self._next_picture:
            self._next_picture = now + REFRESH
            self._display.show(client.figures)

    def _conclude(self, figures: Figures, duration: float) -> None:
        self.result = Result(
            summary_lines(figures, self._joints, duration),
            problems(figures, self._joints),
            warnings(figures),
        )

    def _accompany(self, client: Client, stopped: Callable[[], bool]) -> None:
        try:
            self._follow_stop(client, stopped)
        finally:
            client.close()

    def _follow_stop(self, client: Client, stopped: Callable[[], bool]) -> None:
        """Keep the picture alive until everything has ended: the drives go to disabled in it."""
        self._enter('stopping')
        while not stopped():
            client.listen(REFRESH / 4)
            self._show(client)
        self._display.show(client.figures)
