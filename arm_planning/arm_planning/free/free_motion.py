# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The pipeline of free motion: search, shorten, measure, time, measure again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from itertools import pairwise

import numpy as np

from arm_model import Array, JointLimits
from arm_trajectory import Path

from ..constraints import ConstraintCheck
from ..exceptions import PlanningCode, PlanningError
from ..validity import ValidityCheck
from .motion_check import MotionCheck
from .search import lengths_along, rrt_connect, shortened

MAX_TURN = 3.0 * np.pi
"""Where a joint without end is sampled, to either side of the start, in [rad]."""

MAX_DETOUR_RATIO = 1.25
"""Length of a path, over that of the straight motion to the nearest goal, above which another one
is searched for: shortcuts keep the side of an obstacle on which the search went around it. A
straight motion to a goal ends the search in any case."""

MAX_SEARCHES = 3
"""Searches at most, of which the shortest path counts. Constraints make a search so slow
that the first path counts."""

CHEAP = 150
"""Samples of the search that found a path, below which another one is worth its time."""

RESTART = 1000
"""Samples after which a search begins anew, twice as many each time: some trees grow into a dead
end, and others find a way in a tenth of the time."""

ROUNDING_ROOM = 1.02  # factor of the least times, so that rounding errors break no limit
MAX_ITERATIONS = 30  # how often the times of the motions are improved
STEP_UP = 1.01  # factor of a time that is improved, so that the search for it ends
MIN_HALF = 1e-3  # least of half the time of a rounding in [s]
MIN_PIECE = 1e-9  # least time of a straight motion between two corners in [s]
POWERS = 6  # coefficients of each polynomial of a path
MIN_DURATION = 0.01  # time for a motion between two places at least in [s]


def timed_path(places: Array, limits: JointLimits, check: MotionCheck) -> Path | None:
    """Return a valid path along places; None where none is found.

    Args:
        places: Joint positions in [rad] (m, n), with straight motions between them.
    """
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
    """Return the path along places with its corners rounded, from rest to rest."""
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
    """Return times for the motions (m - 1) in [s] in which there is room to round the corners."""
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
    """Return half the time of the rounding at begin, corners and end (m) in [s].

    A rounding is the quartic that meets the straight motions with the acceleration 0 as long
    before a corner as behind it. Its acceleration is 0.75 of the change of velocity over that
    time at most, its jerk 1.5 of it over the time squared.
    """
    still = np.zeros((1, velocities.shape[1]))
    jumps = np.abs(np.diff(np.concatenate((still, velocities, still)), axis=0))
    by_acceleration = 0.75 * jumps / limits.acceleration
    by_jerk = np.sqrt(1.5 * jumps / limits.jerk)
    halves: Array = ROUNDING_ROOM * np.maximum(by_acceleration, by_jerk).max(axis=1)
    return np.maximum(halves, MIN_HALF)


class FreeMotion:
    """Plans free motions of one arm in one scene; belongs to one thread."""

    def __init__(
        self,
        limits: JointLimits,
        check: ValidityCheck,
        draw: np.random.Generator,
        constraints: ConstraintCheck | None = None,
    ) -> None:
        """Prepare.

        Args:
            check: Has the last word on states and paths, in the scene of the motion.
        """
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
            further: Goals that are looked for while the search runs; None where a try found none.

        Raises:
            PlanningError: No path was found in time.
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
        """Yield ways that look free, straight ones first, and how many samples were drawn.

        A way is None where a search came to its end.
        """
        lower = np.where(self._limits.continuous, start - MAX_TURN, self._limits.lower)
        upper = np.where(self._limits.continuous, start + MAX_TURN, self._limits.upper)
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
