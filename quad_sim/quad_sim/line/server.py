# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The simulated robot in real time, between a pseudo-terminal and the clock: one loop."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
import os
import select
import threading
import time
from typing import TypeVar

from ..board.servos import Plant
from ..exceptions import SetupError
from ..plant.state import BasePose, BaseVelocity
from .pseudo_terminal import PseudoTerminal
from .robot_line import RobotLine

Result = TypeVar('Result')

IDLE_PERIOD = 0.02  # [s] between two turns of the loop on a silent line
TRUTH_PERIOD = 0.02  # [s] between two looks at where it is


@dataclass(frozen=True, slots=True)
class Truth:
    """Where the robot really is."""

    time: float  # of the robot [s]
    pose: BasePose  # of base_link in the world
    velocity: BaseVelocity  # of base_link
    foot_contacts: tuple[bool, ...]  # which feet touch the ground, in the order of the legs


class Server:
    """Lets a robot live in real time; :meth:`run` is its loop, for a thread of its own.

    Attributes:
        truth: Where the robot was last; may be read from any thread.
        stopping: Ends :meth:`run` when it is set.
    """

    def __init__(
        self,
        plant: Plant,
        line: RobotLine,
        terminal: PseudoTerminal,
        watch: Callable[[], None] = lambda: None,
    ) -> None:
        """Connect robot and terminal.

        Args:
            terminal: Where programs find it; closing it is up to the caller.
            watch: Is called every 20 ms, between two turns of the loop.
        """
        self._plant, self._line, self._terminal = plant, line, terminal
        self._actions: deque[tuple[Future[object], Callable[[], object]]] = deque()
        self._wake_read, self._wake_write = os.pipe()
        os.set_blocking(self._wake_read, False)
        self.stopping = threading.Event()
        self._start = time.monotonic()
        self._watch = watch
        self._look()

    def run(self) -> None:
        """Serve until :meth:`stop`.

        Raises:
            SimulationError: The physics blew up, or the port could not be made again.
        """
        self._start = time.monotonic()
        while not self.stopping.is_set():
            self._turn()
            wait = min(max(self._line.next_event - self.now, 0.0), IDLE_PERIOD)
            watched: list[int | PseudoTerminal] = [self._wake_read]
            if self._terminal.plugged:
                watched.append(self._terminal)
            ready, _, _ = select.select(watched, [], [], wait)
            if self._wake_read in ready:
                os.read(self._wake_read, 64)

    def stop(self) -> None:
        """End :meth:`run`; from any thread, also from a signal handler."""
        self.stopping.set()
        self._wake()

    def close(self) -> None:
        """Release what :meth:`stop` and :meth:`submit` need; after the end of :meth:`run`."""
        os.close(self._wake_read)
        os.close(self._wake_write)

    def submit(self, action: Callable[[], Result]) -> Future[Result]:
        """Run an action on the robot between two turns of the loop; thread-safe."""
        future: Future[Result] = Future()
        self._actions.append((future, action))  # type: ignore[arg-type]
        self._wake()
        return future

    @property
    def now(self) -> float:
        """Time of the robot [s]."""
        return time.monotonic() - self._start

    def _wake(self) -> None:
        os.write(self._wake_write, b'.')

    def _turn(self) -> None:
        self._act()
        terminal, line = self._terminal, self._line
        data = terminal.read() if terminal.plugged else b''
        now = self.now  # bytes that came in a pause of this process did not come before it
        if terminal.plugged:
            line.set_baud(terminal.baud)
            if data:
                line.receive(data, now)
        out = line.advance(now)
        if line.plugged != terminal.plugged:
            (terminal.plug if line.plugged else terminal.unplug)()
        if out and terminal.plugged:
            terminal.write(out)
        if now - self._looked_at >= TRUTH_PERIOD:
            self._look()

    def _act(self) -> None:
        while self._actions:
            future, action = self._actions.popleft()
            try:
                future.set_result(action())
            except (SetupError, ValueError) as error:
                future.set_exception(error)

    def _look(self) -> None:
        self._looked_at = self.now
        plant = self._plant
        self.truth = Truth(plant.time, plant.base_pose, plant.base_velocity, plant.foot_contacts)
        self._watch()
