# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a demo does beside the supervisor of its processes: its scenario, client and result."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass, field
import math
import threading
import time
from typing import Any, Generic, Protocol, TypeVar

from process_supervisor import CallError, GivenUpError, Outcome, Phase

from .display import Display

REFRESH_PERIOD = 0.2
"""Time between two pictures in [s]."""


@dataclass(frozen=True, slots=True)
class DemoResult:
    """How a demo went.

    Attributes:
        summary: The lines of its summary, empty when it did not get that far.
        problems: What went wrong.
        warnings: What is worth a look.
    """

    summary: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)


class DemoClient(Protocol):
    """What every demo needs of ROS; ``process_supervisor.graph_client.GraphClient`` has it."""

    @property
    def figures(self) -> Any:  # noqa: ANN401  # each demo has its own
        """What was received last, for the display."""

    def wait_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait for something."""

    def listen(self, duration: float) -> None:
        """Process what comes in."""

    def close(self) -> None:
        """Leave the ROS graph."""


ClientT = TypeVar('ClientT', bound=DemoClient)

MakeClient = Callable[[Callable[[], bool]], ClientT]
"""Joins the ROS graph; the argument returns whether its waiting shall be given up."""


class Supervisor(Protocol):
    """What a demo needs of the supervisor of its processes."""

    @property
    def phase(self) -> Phase:
        """What it is doing."""

    def stop(self, outcome: Outcome) -> None:
        """Request an orderly end."""


class DemoScenario(ABC, Generic[ClientT]):
    """Runs a demo in a thread of its own, beside the supervisor.

    Attributes:
        result: How it went, when the thread has ended.
        opening: The first phase.
    """

    opening = 'starting'

    def __init__(self, display: Display[Any]) -> None:
        """Prepare; nothing happens yet.

        Args:
            display: Where it is shown.
        """
        self.result = DemoResult()
        self._display = display
        self._ending = threading.Event()
        self._moving = threading.Event()
        self._next_picture = 0.0
        self._phase = ''

    @property
    def left(self) -> bool:
        """The user requested the end."""
        return self._ending.is_set()

    def leave(self) -> bool:
        """Request the end, from any thread.

        Returns:
            True when the robot moves: then the scenario brings it to rest before all is stopped.
        """
        self._ending.set()
        return self._moving.is_set()

    def run(self, supervisor: Supervisor, make_client: MakeClient[ClientT]) -> None:
        """Run until the end, and stop the supervisor then.

        Args:
            supervisor: About to be run in the main thread.
            make_client: Makes the demo's ROS client, here in this thread.
        """
        self._enter(self.opening)
        ended = {Phase.STOPPING, Phase.STOPPED}
        client: ClientT | None = None
        try:
            client = make_client(lambda: supervisor.phase in ended)
            self._prepare(client)
            self._wait(
                client,
                lambda: supervisor.phase is Phase.RUNNING,
                math.inf,
                'the processes',
            )
            self._perform(client)
            supervisor.stop(Outcome(0, 'the demo has ended'))
        except GivenUpError:
            pass  # the supervisor knows why
        except CallError as error:
            supervisor.stop(Outcome(1, str(error)))
        except BaseException as error:
            supervisor.stop(Outcome(1, f'{type(error).__name__}: {error}'))
            raise
        finally:
            if client is not None:
                self._accompany(client, lambda: supervisor.phase is Phase.STOPPED)

    def _prepare(self, client: ClientT) -> None:  # a scenario may need nothing
        """Do what can be done while the processes start."""

    @abstractmethod
    def _perform(self, client: ClientT) -> None:
        """Do it all, from when the processes are ready to the standstill of the robot."""

    def _wait(
        self, client: ClientT, condition: Callable[[], bool], timeout: float, what: str
    ) -> None:
        """Wait for something while the figures are shown."""

        def reached() -> bool:
            self._show(client)
            return condition()

        client.wait_until(reached, timeout, what)

    def _enter(self, phase: str) -> None:
        if phase != self._phase:
            self._phase = phase
            self._display.phase(phase)

    def _show(self, client: ClientT) -> None:
        now = time.monotonic()
        if now >= self._next_picture:
            self._next_picture = now + REFRESH_PERIOD
            self._display.show(client.figures)

    def _accompany(self, client: ClientT, stopped: Callable[[], bool]) -> None:
        """Keep the picture alive until everything has ended: drives go to disabled in it."""
        try:
            self._enter('stopping')
            while not stopped():
                client.listen(REFRESH_PERIOD / 4)
                self._show(client)
            self._display.show(client.figures)
        finally:
            client.close()
