# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The pipeline of free motion: search, shorten, measure, time, measure again."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import numpy as np

from arm_model import Array, JointLimits
from arm_trajectory import Path

from ..constraints import ConstraintCheck
from ..exceptions import PlanningCode, PlanningError
from ..validity import ValidityCheck
from .motion_check import MotionCheck
from .search import lengths_along, rrt_connect, shortened
from .timing import timed_path

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
