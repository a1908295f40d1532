# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The pipeline of free motion: search, shorten, measure, time, measure again."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from arm_model import Array, JointLimits
from arm_trajectory import Path

from ..constraints import ConstraintCheck
from ..exceptions import PlanningCode, PlanningError
from ..validity import ValidityCheck, Violation
from .constrained_check import ConstrainedCheck
from .motion_check import MotionCheck
from .rrt_connect import rrt_connect
from .shortcut import shortened
from .timing import timed_path

MAX_TURN = 3.0 * np.pi
"""Where a joint without end is sampled, to either side of the start, in [rad]."""


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
            limits: Limits of the joints, scaled by the request.
            check: Has the last word on states and paths, in the scene of the motion.
            draw: Source of the random numbers.
            constraints: What holds everywhere on the path; None for nothing.
        """
        self._limits, self._check, self._draw = limits, check, draw
        self._constraints = constraints

    def plan(self, start: Array, goals: Sequence[Array], expired: Callable[[], bool]) -> Path:
        """Return a path to one of some goals, timed and valid.

        Args:
            start: Joint positions in [rad] (n), valid; constraints hold there.
            goals: Alternatives in [rad] (k, n), valid; constraints hold there.
            expired: Whether the time is over.

        Raises:
            PlanningError: No path was found in time.
        """
        motions = MotionCheck(self._check, (start, *goals), self._constraints)
        check = ConstrainedCheck(self._check, self._constraints)
        near: Violation | None = None
        while not expired():
            places = rrt_connect(start, goals, self._sampler(start), motions, expired)
            if places is None:
                break
            places = shortened(places, self._draw, motions, expired)
            path = timed_path(places, self._limits, check)
            if path is not None:
                return path
            near = check.waypoints(places)
        hint = '' if near is None else f'; the last one was refused: {near.reason}'
        raise PlanningError(
            PlanningCode.TIMED_OUT,
            f'no path was found in time{hint}; allow more time, or make room at start and goal',
        )

    def _sampler(self, start: Array) -> Callable[[], Array]:
        lower = np.where(self._limits.continuous, start - MAX_TURN, self._limits.lower)
        upper = np.where(self._limits.continuous, start + MAX_TURN, self._limits.upper)
        return lambda: self._draw.uniform(lower, upper)
