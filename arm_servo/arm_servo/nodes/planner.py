# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Trajectories are planned in a thread of their own, and begin in the cycle foreseen for them."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import CancelledError, Future, ThreadPoolExecutor
from concurrent.futures import TimeoutError as FutureTimeoutError
from dataclasses import replace
import math
import time

import numpy as np

from ..core import MotionCore
from ..exceptions import GoalCode, GoalError, NotReadyError
from ..execution import Execution
from ..goal import TrajectoryGoal
from ..otg import MotionState
from ..set_point import Source
from .desk import Desk, Snapshot

AT_LEAST = 5e-3
"""Time that planning may take for any trajectory in [s]; this and the next: see core.plan."""

PER_POINT = 5e-4
"""Time that planning may take for each point in [s]."""

PER_SECOND = 5e-3
"""Time that looking for collisions may take for each second of the path in [s]."""

SHORT = 0.03
"""Time over which a jog or a single target is foreseen in [s]; for longer it may end or turn."""

PATIENCE = 1.0
"""Time in which the cycle must answer in [s]."""

LONGEST = 100.0
"""Part of a trajectory for whose check a begin in motion waits in [s]."""

DISPLACED = 0.05
"""How far the arm may be from where a trajectory was planned in [rad]: its way was looked at."""

ATTEMPTS = 3
"""How often a trajectory is planned at most, where others move the arm meanwhile."""

LEAST = 3
"""Least cycles from the begin of the planning to that of the motion, where the arm moves."""


class Planner:
    """Plans trajectories one after another.

    MoveIt's plans have tens to hundreds of points: the cycle has no time to plan them. Where the
    arm moves, a trajectory is planned from where it will be some cycles later, and begins then;
    what the foresight was off, the core catches up smoothly. Where nobody can know, since the arm
    is jogged and the planning takes long, it comes to rest first.
    """

    def __init__(self, desk: Desk, check: Callable[[], None]) -> None:
        """Prepare; the thread begins with the first trajectory.

        Args:
            desk: The core's desk.
            check: Called in the cycle before a trajectory begins; raises why it must not.
        """
        self._desk = desk
        self._check = check
        self._worker = ThreadPoolExecutor(1, thread_name_prefix='trajectory planner')

    def follow(self, goal: TrajectoryGoal) -> Future[Execution]:
        """Have a trajectory planned and followed.

        Args:
            goal: The trajectory.

        Returns:
            Its execution once it began, or why it is refused. Cancelled, it does not begin.
        """
        answer: Future[Execution] = Future()
        self._worker.submit(self._plan, goal, answer)
        return answer

    def _plan(
        self, goal: TrajectoryGoal, answer: Future[Execution], attempts: int = ATTEMPTS
    ) -> None:
        began = time.monotonic()
        try:
            execution, state, begin = self._planned(goal)
        except Exception as error:  # noqa: BLE001  # whoever ordered it is told
            _refuse(answer, error)
            return

        def start(core: MotionCore, _now: float) -> Execution:
            self._check()
            _check_place(core, state)
            if not answer.set_running_or_notify_cancel():
                raise CancelledError
            core.begin(execution)
            return execution

        def finish(order: Future[Execution]) -> None:
            error = order.exception()
            if isinstance(error, _DisplacedError) and attempts > 1 and not answer.cancelled():
                age = goal.age and goal.age + time.monotonic() - began
                self._worker.submit(self._plan, replace(goal, age=age), answer, attempts - 1)
            elif error is None:
                answer.set_result(order.result())
            else:
                _refuse(answer, error)

        self._desk.submit(start, begin=begin).add_done_callback(finish)

    def _planned(self, goal: TrajectoryGoal) -> tuple[Execution, MotionState, float]:
        """Return the execution, the state and the steady time in [s] at which it begins."""
        snapshot = self._desk.snapshot
        if snapshot.set_point is None or snapshot.blocked:
            state = self._state()
            return self._desk.plan(goal, state), state, 0.0
        state = snapshot.set_point.state
        if not state.moving and snapshot.source is Source.NONE:
            return self._desk.plan(goal, state), state, 0.0
        needed = AT_LEAST + PER_POINT * len(goal.points) + PER_SECOND * _duration(goal)
        if snapshot.source is not Source.TRAJECTORY and needed > SHORT:
            return (*self._planned_at_rest(goal, state), 0.0)
        cycles = max(LEAST, math.ceil(needed / snapshot.period) + 1)
        lead = (cycles - 1) * snapshot.period
        if goal.age:
            goal = replace(goal, age=goal.age + lead)
        state = _foreseen(snapshot, state, lead)
        execution = self._desk.plan(goal, state)
        return execution, state, snapshot.time + (cycles - 0.5) * snapshot.period

    def _planned_at_rest(
        self, goal: TrajectoryGoal, state: MotionState
    ) -> tuple[Execution, MotionState]:
        """Bring the arm to rest, and plan from there; a goal that is refused does not stop it."""
        began = time.monotonic()
        self._desk.plan(goal, MotionState.at_rest(state.position))
        stop = self._desk.submit(lambda core, _now: core.stop('a trajectory takes over'))
        while True:
            snapshot = self._desk.snapshot
            point, idle = snapshot.set_point, snapshot.source is Source.NONE
            if stop.done():
                stop.result()
            if stop.done() and point is not None and idle and not point.state.moving:
                age = goal.age and goal.age + time.monotonic() - began
                return self._desk.plan(replace(goal, age=age), point.state), point.state
            if time.monotonic() - began > PATIENCE:
                raise NotReadyError(
                    'the arm does not come to rest for the trajectory; end the commands that'
                    ' jog it'
                )
            time.sleep(snapshot.period)

    def _state(self) -> MotionState:
        """Ask the cycle for the commanded state: the arm may follow from now on."""
        order = self._desk.submit(lambda core, _now: core.state)
        try:
            return order.result(PATIENCE)
        except FutureTimeoutError as error:
            order.cancel()
            raise NotReadyError('the cycle does not run; is the bus up?') from error


class _DisplacedError(GoalError):
    """The arm is elsewhere than where a trajectory was planned."""


def _check_place(core: MotionCore, planned: MotionState) -> None:
    """Make sure that the arm is where a trajectory was planned; else its way is another one."""
    off = np.abs(core.state.position - planned.position)
    joint = int(np.argmax(off))
    if off[joint] > DISPLACED:
        raise _DisplacedError(
            GoalCode.INVALID_GOAL,
            f'{core.model.joints[joint]} was moved by {off[joint]:.3f} rad while the trajectory'
            ' was planned, and its way was looked at from there only; end what moves the arm, and'
            ' send it again',
        )


def _foreseen(snapshot: Snapshot, state: MotionState, ahead: float) -> MotionState:
    """Return where the arm will be some time after a commanded state."""
    if snapshot.source is Source.TRAJECTORY and snapshot.execution is not None:
        return snapshot.execution.foreseen(ahead)
    still = 0.0 * state.acceleration
    return MotionState(state.position + ahead * state.velocity, state.velocity, still)


def _duration(goal: TrajectoryGoal) -> float:
    """Return about how long a goal lasts in [s]; it is not checked yet."""
    last = goal.points[-1].time if goal.points else 0.0
    return min(max(last - goal.age, 0.0), LONGEST) if math.isfinite(last) else 0.0


def _refuse(answer: Future[Execution], error: BaseException) -> None:
    """Tell why it does not begin, unless nobody waits any more."""
    if answer.cancelled() or isinstance(error, CancelledError):
        return
    if answer.running() or answer.set_running_or_notify_cancel():
        answer.set_exception(error)
