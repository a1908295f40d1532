# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where any thread leaves commands for the motion core, and reads what it does."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
import math
import threading
import time
from typing import Any, Generic, TypeVar

import numpy as np

from ..arrays import Array
from ..core import MotionCore
from ..exceptions import GoalCode, NotReadyError
from ..execution import Execution, Outcome
from ..goal import TrajectoryGoal
from ..model import RobotModel
from ..otg import MotionState
from ..planning import Way
from ..set_point import SetPoint, Source

T = TypeVar('T')

LATEST = 0.25
"""Age at which a command is refused in [s]: the cycle stood still, and it would surprise."""

MOST = 1000
"""Commands that may wait."""


@dataclass(frozen=True, slots=True, eq=False)
class Snapshot:
    """What the core does, for any thread.

    Attributes:
        time: Steady time of the cycle in [s].
        set_point: What was commanded; None while the arm does not follow.
        measured: What was measured; None before the first feedback.
        blocked: Why the arm does not follow, with the remedy; empty while it does.
        source: What moves it.
        paused: Whether it is paused.
        speed: Speed override, 0 to 1.
        cycles: Cycles so far in which the arm followed.
        period: Period of the cycle in [s].
        execution: The trajectory that was followed last; None before the first.
    """

    time: float
    set_point: SetPoint | None
    measured: MotionState | None
    blocked: str
    source: Source = Source.NONE
    paused: bool = False
    speed: float = 1.0
    cycles: int = 0
    period: float = 0.01
    execution: Execution | None = None

    @property
    def pace(self) -> float:
        """Speed override that counts, 0 to 1: none while it is paused."""
        return 0.0 if self.paused else self.speed

    @property
    def reference(self) -> MotionState | None:
        """Where the arm is to be: where it stands while it does not follow; None while unknown."""
        if self.set_point is not None:
            return self.set_point.state
        if self.measured is None or not np.isfinite(self.measured.position).all():
            return None
        return MotionState.at_rest(self.measured.position)

    def stale(self, age: float) -> str:
        """Say that the cycle does not run; empty when it does.

        Args:
            age: Time since the cycle of this snapshot in [s].
        """
        if age <= LATEST:
            return ''
        begun = f'{age:.1f} s ago' if self.time else 'never'
        return f'the cycle does not run (the last was {begun}); is the bus up?'


@dataclass(slots=True)
class _Order(Generic[T]):
    command: Callable[[MotionCore, float], T]
    future: Future[T]
    time: float
    moves: bool
    begin: float


class Desk:
    """Commands to one motion core from any thread, carried out by the thread that steps it.

    :meth:`submit`, :attr:`snapshot` and :attr:`model` are for any thread; the rest is for the
    cycle. The kinematics of the core's model belong to the cycle too: what needs them goes there
    as a command.

    Attributes:
        model: The arm.
        refused: Steady time at which a motion was refused last in [s], as the arm did not follow.
    """

    def __init__(self, core: MotionCore, clock: Callable[[], float] = time.monotonic) -> None:
        """Wait for the arm.

        Args:
            core: The core; from here on it is the desk's.
            clock: Steady time in [s], the one of the cycle.
        """
        self.model: RobotModel = core.model
        self.refused = -math.inf
        self._core = core
        self._clock = clock
        self._orders: deque[_Order[Any]] = deque()
        self._snapshot = Snapshot(0.0, None, None, 'the cycle has not begun yet')
        self._planning = threading.Lock()

    @property
    def snapshot(self) -> Snapshot:
        """What the core did in the last cycle."""
        return self._snapshot

    def submit(
        self,
        command: Callable[[MotionCore, float], T],
        *,
        moves: bool = True,
        begin: float = 0.0,
    ) -> Future[T]:
        """Have a command carried out at the begin of the next cycle, or of a later one.

        Args:
            command: Called with the core and the steady time in [s]; it must not wait.
            moves: It makes the arm move, so it is refused while the arm does not follow, and when
                it has waited for longer than :data:`LATEST`.
            begin: Steady time before which it is not carried out in [s].

        Returns:
            Its result, or the ServoError with which it was refused.
        """
        order = _Order(command, Future[T](), self._clock(), moves, begin)
        if len(self._orders) >= MOST:
            order.future.set_exception(NotReadyError(f'{MOST} commands wait for the cycle'))
        else:
            self._orders.append(order)
        return order.future

    def plan(self, goal: TrajectoryGoal, state: MotionState) -> Execution:
        """Plan a trajectory outside of the cycle, for which it would take too long; any thread.

        Args:
            goal: The trajectory.
            state: The commanded state at which it will begin.

        Raises:
            GoalError: It is refused.
        """
        with self._planning:
            return self._core.plan(goal, state)

    def check(self, way: Way) -> None:
        """Look for collisions on the way to a single target, outside of the cycle; any thread.

        Args:
            way: The way.

        Raises:
            CommandError: Links meet on it.
        """
        with self._planning:
            self._core.check(way)

    def begin(self, positions: Array) -> None:
        """Take the arm over where it stands.

        Args:
            positions: Positions last commanded to the drives in [rad].
        """
        self._core.reset(positions)

    def step(self, now: float, period: float, measured: MotionState, blocked: str) -> SetPoint:
        """Carry out what was ordered, and return the set-point of this cycle.

        Args:
            now: Steady time in [s].
            period: Time to the next cycle in [s].
            measured: Measured state.
            blocked: Why the arm comes to rest and takes no commands; empty when it does.
        """
        self._obey(now, blocked)
        set_point = self._core.step(now, period, measured)
        self._snapshot = Snapshot(
            now,
            set_point,
            measured,
            blocked,
            set_point.source,
            self._core.paused,
            self._core.speed,
            self._snapshot.cycles + 1,
            period,
            self._core.execution,
        )
        return set_point

    def fail(self, reason: str) -> None:
        """Bring the arm to rest, a trajectory on its path; the trajectory ends with the reason.

        Args:
            reason: What has gone wrong, and where.
        """
        execution = self._core.execution
        if self._core.source is Source.TRAJECTORY and execution is not None:
            execution.stop(Outcome(GoalCode.PATH_TOLERANCE_VIOLATED, reason))
        else:
            self._core.stop(reason)

    def idle(self, now: float, measured: MotionState | None, blocked: str) -> None:
        """Pass a cycle in which the arm does not follow; commands are refused.

        Args:
            now: Steady time in [s].
            measured: Measured state, when it is known.
            blocked: Why, with the remedy.
        """
        self._obey(now, blocked)
        execution = self._core.execution
        if execution is not None:  # it ended at the latest when the arm came to rest
            execution.abandon(Outcome(GoalCode.PATH_TOLERANCE_VIOLATED, blocked))
        self._snapshot = Snapshot(
            now,
            None,
            measured,
            blocked,
            paused=self._core.paused,
            speed=self._core.speed,
            cycles=self._snapshot.cycles,
        )

    def _obey(self, now: float, blocked: str) -> None:
        for _ in range(len(self._orders)):
            order = self._orders.popleft()
            if order.begin > now and not blocked:
                self._orders.append(order)
                continue
            if not order.future.set_running_or_notify_cancel():
                continue
            try:
                self._admit(order, now, blocked)
                order.future.set_result(order.command(self._core, now))
            except Exception as error:  # noqa: BLE001  # whoever ordered it is told
                order.future.set_exception(error)

    def _admit(self, order: _Order[Any], now: float, blocked: str) -> None:
        if not order.moves:
            return
        if blocked:
            self.refused = now
            raise NotReadyError(blocked)
        if (age := now - max(order.time, order.begin)) > LATEST:
            raise NotReadyError(f'the cycle stood still for {age:.2f} s')
