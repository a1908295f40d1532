# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The free-motion pipeline: sample goals, search, shorten, check, time, check again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from itertools import count, islice, pairwise

import numpy as np

from arm_model import Array, checked, frozen, JointLimits, RobotModel
from arm_trajectory import Path

from .constraints import ConstraintCheck
from .exceptions import coded, PlanningCode, PlanningError
from .ik import DEFAULT_TIMEOUT, IkSolver
from .requests import Goal, JointGoal, PathConstraints, PoseGoal
from .rrt_connect import lengths_along, MotionCheck, rrt_connect, shortened
from .validity import ValidityCheck

MAX_TURN = 3.0 * np.pi
"""Sampling range of a continuous joint to either side of the start in [rad]."""

MAX_DETOUR_RATIO = 1.25
"""Ratio of path length to the straight motion to the nearest goal; above it the search is
repeated, because shortcuts never move a path to the other side of an obstacle. A straight
motion to a goal always ends the search."""

MAX_SEARCHES = 3
"""Greatest number of searches; the shortest path is used. Constraints make a search so slow
that the first path is used."""

CHEAP = 150  # samples of the search that found a path, below which another one is worth its time

RESTART = 1000
"""Samples before a search restarts, doubled at each restart: some trees grow into a dead end,
while others find a path in a tenth of the time."""


class FreeMotion:
    """Plans free motions of one arm in one scene. Not thread-safe."""

    def __init__(
        self,
        limits: JointLimits,
        check: ValidityCheck,
        draw: np.random.Generator,
        constraints: ConstraintCheck | None = None,
    ) -> None:
        self._limits, self._check, self._draw = limits, check, draw
        self._constraints = constraints

    def plan(
        self,
        start: Array,
        goals: Sequence[Array],
        expired: Callable[[], bool],
        further: Iterable[Array | None] = (),
    ) -> Path:
        """Return a path to one of some goals, timed and valid.

        Args:
            start: Joint positions in [rad] (n), valid; constraints hold there.
            goals: Alternatives in [rad] (k, n), valid; constraints hold there.
            further: Goals found while the search runs; None for a try without result.
        """
        motions = MotionCheck(self._check, (start, *goals), self._constraints)
        goals = sorted(goals, key=lambda goal: float(np.linalg.norm(goal - start)))
        direct = float(np.linalg.norm(goals[0] - start))
        searches = MAX_SEARCHES if self._constraints is None else 1
        found: Path | None = None
        shortest, near = np.inf, None
        ways = self._ways(start, goals, motions, expired, iter(further))
        for tried, (places, drawn) in enumerate(ways, 1):
            if places is None:
                if found is not None:
                    break
                continue
            length = float(lengths_along(places)[-1])
            if length < shortest:
                path = timed_path(places, self._limits, motions)
                if path is None:
                    near = motions.waypoints(places)
                    continue
                found, shortest = path, length
            straight = len(places) == 2 or length <= MAX_DETOUR_RATIO * direct
            if straight or tried >= searches or drawn > CHEAP:
                break
        if found is not None:
            return found
        hint = '' if near is None else f'; the last one was refused: {near.reason}'
        raise PlanningError(
            PlanningCode.TIMED_OUT,
            f'no path was found in time{hint}; allow more time, or make room at start and goal',
        )

    def _ways(
        self,
        start: Array,
        goals: Sequence[Array],
        motions: MotionCheck,
        expired: Callable[[], bool],
        further: Iterator[Array | None],
    ) -> Iterator[tuple[Array | None, int]]:
        """Yield paths that look free, straight ones first, with the number of samples drawn.

        The path is None if a search ended without one.
        """
        lower, upper = self._limits.span(start, MAX_TURN)
        drawn, most, known = 0, RESTART, list(goals)

        def sample(count: int) -> Array:
            nonlocal drawn
            drawn += count
            states: Array = lower + (upper - lower) * self._draw.random((count, len(start)))
            return states

        for goal in goals:
            if motions.clear(start, goal):
                yield np.array((start, goal)), drawn
        while not expired():
            places = rrt_connect(
                start, known, sample, motions, expired, further=further, most=most
            )
            if places is None:
                most *= 2
            else:
                most, places = CHEAP, shortened(places, self._draw, motions, expired)
            yield places, drawn


ROUNDING_ROOM = 1.02  # factor of the least times, so that rounding errors break no limit

MAX_ITERATIONS = 30  # how often the times of the motions are improved

STEP_UP = 1.01  # factor of a time that is improved, so that the search for it ends

MIN_HALF = 1e-3  # least of half the time of a rounding in [s]

MIN_PIECE = 1e-9  # least time of a straight motion between two corners in [s]

POWERS = 6  # coefficients of each polynomial of a path

MIN_DURATION = 0.01  # time for a motion between two places at least in [s]


def timed_path(places: Array, limits: JointLimits, check: MotionCheck) -> Path | None:
    """Return a valid timed path along straight motions between waypoints, or None."""
    stops: set[int] = set()
    corners = set(range(1, len(places) - 1))
    while True:
        ends = [0, *sorted(stops), len(places) - 1]
        pieces = [_rounded(places[begin : end + 1], limits) for begin, end in pairwise(ends)]
        found = [piece for piece in pieces if piece is not None]
        path = Path.joined(found) if len(found) == len(pieces) else None
        violation = None if path is None else check.path(path)
        if path is not None and violation is None:
            return path
        left = sorted(corners - stops)
        if not left or (not stops and check.waypoints(places) is not None):
            return None
        if violation is None:
            stops.update(left)
        else:
            apart = np.abs(places[left] - violation.positions).max(axis=1)
            stops.add(left[int(apart.argmin())])


def _rounded(places: Array, limits: JointLimits) -> Path | None:
    """Return the path along waypoints with rounded corners, from rest to rest."""
    durations = _durations(places, limits)
    velocities = np.diff(places, axis=0) / durations[:, None]
    halves = _half_times(velocities, limits)
    straight = durations - halves[:-1] - halves[1:]
    if (straight < 0.0).any():
        return None
    still = np.zeros((1, places.shape[1]))
    before, after = np.concatenate((still, velocities)), np.concatenate((velocities, still))
    lasts, change = 2.0 * halves, after - before
    # each corner, then the straight motion behind it; before the first there is none
    pieces = np.zeros((2 * len(places) - 1, POWERS, places.shape[1]))
    pieces[::2, 0], pieces[::2, 1] = places - before * halves[:, None], before
    pieces[::2, 3] = change / lasts[:, None] ** 2
    pieces[::2, 4] = -0.5 * change / lasts[:, None] ** 3
    pieces[1::2, 0], pieces[1::2, 1] = (places + after * halves[:, None])[:-1], velocities
    times = np.zeros(len(pieces))
    times[::2], times[1::2] = lasts, straight
    there = times > MIN_PIECE
    return Path(times[there], pieces[there])


def _durations(places: Array, limits: JointLimits) -> Array:
    """Return durations of the motions (m - 1) in [s], long enough to round the corners."""
    steps = np.diff(places, axis=0)
    durations: Array = (np.abs(steps) / limits.velocity).max(axis=1) * ROUNDING_ROOM
    durations = np.maximum(durations, MIN_DURATION)
    for _ in range(MAX_ITERATIONS):
        halves = _half_times(steps / durations[:, None], limits)
        least = 2.0 * np.maximum(halves[:-1], halves[1:])
        if (least <= durations).all():
            break
        durations = np.where(least > durations, STEP_UP * np.sqrt(least * durations), durations)
    return durations


def _half_times(velocities: Array, limits: JointLimits) -> Array:
    """Return half the duration of the blend at begin, corners and end (m) in [s].

    A blend is the quartic that joins the straight motions with zero acceleration this time
    before and after a corner. Its acceleration is at most 0.75 times the change of velocity
    over that time, its jerk 1.5 times that change over the time squared.
    """
    still = np.zeros((1, velocities.shape[1]))
    jumps = np.abs(np.diff(np.concatenate((still, velocities, still)), axis=0))
    by_acceleration = 0.75 * jumps / limits.acceleration
    by_jerk = np.sqrt(1.5 * jumps / limits.jerk)
    halves: Array = ROUNDING_ROOM * np.maximum(by_acceleration, by_jerk).max(axis=1)
    return np.maximum(halves, MIN_HALF)


GOAL_SAMPLES = 60
"""Greatest number of states projected into the tolerances of a goal that is itself unreachable."""

IK_SOLUTIONS = 4  # solutions of inverse kinematics that are goals of a free motion at most

_NOT_EXACTLY = (
    PlanningCode.GOAL_STATE_INVALID,
    PlanningCode.GOAL_IN_COLLISION,
    PlanningCode.NO_IK_SOLUTION,
    PlanningCode.GOAL_VIOLATES_PATH_CONSTRAINTS,
)
"""Error codes after which a goal may still be reached within its tolerances."""


class GoalStates:
    """Finds goal states that are valid and satisfy the path constraints, for one start."""

    def __init__(
        self,
        model: RobotModel,
        solver: Callable[[str], IkSolver],
        draw: np.random.Generator,
        *,
        start: Array,
        check: ValidityCheck,
        constraints: ConstraintCheck | None,
    ) -> None:
        self._model, self._solver, self._draw = model, solver, draw
        self._start, self._check, self._constraints = start, check, constraints

    def first(self, goals: Sequence[Goal], left: Callable[[], float]) -> list[Array]:
        """Return states of all goals, or raise the error of the first; ``left`` is in [s]."""
        found: list[Array] = []
        for goal in goals:
            if left() < 0.0:
                break
            with suppress(PlanningError):
                found += self._states(goal, DEFAULT_TIMEOUT)
        if found:
            return found
        refused: PlanningError | None = None
        for goal in goals:  # as long as it takes
            timeout = left()
            if refused is not None and timeout < 0.0:
                break
            try:
                return self._states(goal, max(timeout, DEFAULT_TIMEOUT))
            except PlanningError as error:
                refused = refused or error
        raise refused or PlanningError(PlanningCode.INVALID_GOAL_CONSTRAINTS, 'no goal')

    def further(self, goals: Sequence[Goal]) -> Iterator[Array | None]:
        """Yield further states of pose goals endlessly; None for a try without result."""
        sources = [
            source(goal)
            for goal in goals
            if isinstance(goal, PoseGoal)
            for source in (self._solutions, self._tolerated)
        ]
        while sources:
            yield from (next(each, None) for each in sources)

    def _states(self, goal: Goal, timeout: float) -> list[Array]:
        try:
            return self._heeding(self._exact(goal, timeout))
        except PlanningError as error:
            if error.code not in _NOT_EXACTLY:
                raise
            tried = islice(self._tolerated(goal), GOAL_SAMPLES)
            found = (state for state in tried if state is not None)
            states = list(islice(found, IK_SOLUTIONS))
            if not states:
                raise
            return states

    def _exact(self, goal: Goal, timeout: float) -> list[Array]:
        """Return the valid states exactly at a goal."""
        if isinstance(goal, JointGoal):
            with coded(PlanningCode.INVALID_GOAL_CONSTRAINTS):
                state = checked(goal.positions, len(self._model), 'goal')
            states = [frozen(self._model.limits.in_nearest_turn(state, self._start))]
        else:
            wanted = IK_SOLUTIONS if timeout == DEFAULT_TIMEOUT else 1
            states = self._solver(goal.link).solve(
                goal.pose, self._start, self._check.scene, timeout, wanted
            )
        valid, refused = [], []
        for state in states:
            violation = self._check.state(state)
            if violation is None:
                valid.append(state)
            else:
                refused.append(violation)
        if not valid:
            in_contact = refused[0].contact is not None
            raise PlanningError(
                PlanningCode.GOAL_IN_COLLISION if in_contact else PlanningCode.GOAL_STATE_INVALID,
                f'goal: {refused[0].reason}',
            )
        return valid

    def _heeding(self, goals: list[Array]) -> list[Array]:
        """Return the goals that satisfy the path constraints, or raise why none does."""
        constraints = self._constraints
        found = [goal for goal in goals if constraints is None or constraints.heeds(goal)]
        if constraints is not None and not found:
            raise PlanningError(
                PlanningCode.GOAL_VIOLATES_PATH_CONSTRAINTS,
                f'goal: {constraints.reason(goals[0])}; choose a goal where the constraint holds',
            )
        return found

    def _solutions(self, goal: PoseGoal) -> Iterator[Array | None]:
        """Yield further solutions of a pose endlessly; None for a start without result."""
        solver = self._solver(goal.link)
        while solver.closed_form is None:  # else all are known
            yield self._valid(solver.another(goal.pose, self._start))

    def _tolerated(self, goal: Goal) -> Iterator[Array | None]:
        """Yield states within the tolerances of a goal endlessly; None for a try without result.

        The first ones are near the start, the others anywhere.
        """
        limits, start = self._model.limits, self._start
        lower, upper = limits.span(start)
        if isinstance(goal, JointGoal):
            if not goal.tolerance.any():
                return
            there = limits.in_nearest_turn(goal.positions, start)
            lower = np.maximum(limits.lower, there - goal.tolerance)
            upper = np.minimum(limits.upper, there + goal.tolerance)
            ranges = zip(lower.tolist(), upper.tolist(), strict=True)
            tolerances = PathConstraints(dict(zip(self._model.joints, ranges, strict=True)))
        elif goal.tolerances is None:
            return
        else:
            tolerances = goal.tolerances
        if (lower > upper).any():
            return  # beyond a limit by more than the tolerance
        others = () if self._constraints is None else self._constraints.constraints
        within = ConstraintCheck(self._model, tolerances, *others)
        near = np.clip(start, lower, upper)
        for number in count():
            share = min(number / GOAL_SAMPLES, 1.0)
            drawn = near + share * (self._draw.uniform(lower, upper) - near)
            state = within.projected(drawn, rooms=0.0)
            yield self._valid(None if state is None else frozen(state))

    def _valid(self, state: Array | None) -> Array | None:
        """Return the state if it is valid and satisfies the constraints, else None."""
        if state is None or self._check.state(state) is not None:
            return None
        constraints = self._constraints
        return state if constraints is None or constraints.heeds(state) else None
