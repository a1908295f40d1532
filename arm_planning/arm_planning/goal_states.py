# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""States of the joints that reach the goals of a free motion."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from itertools import count, islice

import numpy as np

from arm_model import Array, checked, frozen, RobotModel

from .constraints import ConstraintCheck
from .exceptions import coded, PlanningCode, PlanningError
from .ik.solver import DEFAULT_TIMEOUT, IkSolver
from .requests import Goal, JointGoal, PathConstraints, PoseGoal
from .validity import ValidityCheck

GOAL_SAMPLES = 60
"""States that are led into the tolerances of a goal which cannot be reached itself, at most."""

IK_SOLUTIONS = 4  # solutions of inverse kinematics that are goals of a free motion at most

_NOT_EXACTLY = (
    PlanningCode.GOAL_STATE_INVALID,
    PlanningCode.GOAL_IN_COLLISION,
    PlanningCode.NO_IK_SOLUTION,
    PlanningCode.GOAL_VIOLATES_PATH_CONSTRAINTS,
)
"""Codes of goals that may still be reached within their tolerances."""


class GoalStates:
    """Finds the states of goals that are valid and heed path constraints, from one start."""

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
        """Return states of all goals, or raise what is wrong with the first goal.

        Args:
            left: Returns the time that is left in [s].
        """
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
        """Yield further states of poses without end, None where a try found none."""
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
        """Return the states at a goal itself, which are valid."""
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
        """Return the goals that heed path constraints, or raise why none does."""
        constraints = self._constraints
        found = [goal for goal in goals if constraints is None or constraints.heeds(goal)]
        if constraints is not None and not found:
            raise PlanningError(
                PlanningCode.GOAL_VIOLATES_PATH_CONSTRAINTS,
                f'goal: {constraints.reason(goals[0])}; choose a goal where the constraint holds',
            )
        return found

    def _solutions(self, goal: PoseGoal) -> Iterator[Array | None]:
        """Yield further solutions of a pose without end, None where a start led to none."""
        solver = self._solver(goal.link)
        while solver.closed_form is None:  # else all are known
            yield self._valid(solver.another(goal.pose, self._start))

    def _tolerated(self, goal: Goal) -> Iterator[Array | None]:
        """Yield states within the tolerances of a goal without end, None where a try found none.

        The first are near to the start, the others anywhere.
        """
        limits, start = self._model.limits, self._start
        lower = np.where(limits.continuous, start - np.pi, limits.lower)
        upper = np.where(limits.continuous, start + np.pi, limits.upper)
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
        """Return a state that is valid and heeds constraints, else None."""
        if state is None or self._check.state(state) is not None:
            return None
        constraints = self._constraints
        return state if constraints is None or constraints.heeds(state) else None
