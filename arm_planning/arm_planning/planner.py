# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The way in: a request becomes a plan, by the pipeline that its planner_id names."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import count, islice
import time

import numpy as np

from arm_model import Array, checked, CommandError, frozen, PlanningScene, Pose, RobotModel

from .constraints import ConstraintCheck
from .exceptions import PlanningCode, PlanningError
from .free.free_motion import FreeMotion
from .ik.solver import DEFAULT_TIMEOUT, IkSolver
from .industrial.limits import CartesianLimits
from .industrial.planner import IndustrialPlanner, PLANNER_IDS
from .industrial.sequence import SequenceItem
from .link_speed import speed_limited
from .requests import Goal, JointGoal, MotionPlan, MotionRequest, PathConstraints, PoseGoal
from .validity import ValidityCheck, Violation

FREE_MOTION = ('RRTConnectkConfigDefault', 'RRTConnect', 'geometric::RRTConnect')
"""Names of MoveIt and OMPL for the planner of free motion."""

GOAL_SAMPLES = 60
"""States that are led into the tolerances of a goal which cannot be reached itself, at most."""

IK_SOLUTIONS = 4  # solutions of inverse kinematics that are goals of a free motion at most
CANCELED = 'canceled while it was planned'  # why a plan was not found
DEFAULT_PLANNER = FREE_MOTION[0]  # what plans a request without a planner_id


class Planner:
    """Plans motions of one arm; belongs to one thread."""

    def __init__(
        self,
        model: RobotModel,
        cartesian_limits: CartesianLimits | None = None,
        clock: Callable[[], float] = time.monotonic,
        seed: int = 0,
    ) -> None:
        """Prepare.

        Args:
            model: The arm; its scene counts where a call has none.
            clock: Steady time in [s], for time-outs.
            seed: Of the random numbers: with the same seed and time enough, the same plans.
        """
        self._model, self._clock = model, clock
        self._draw = np.random.default_rng(seed)
        self._industrial = IndustrialPlanner(model, cartesian_limits, clock)
        self._solvers: dict[str, IkSolver] = {}
        self._check: ValidityCheck | None = None

    def plan(
        self,
        request: MotionRequest,
        scene: PlanningScene | None = None,
        is_canceled: Callable[[], bool] = lambda: False,
    ) -> MotionPlan:
        """Return a motion that is valid everywhere.

        Args:
            scene: What may collide; by default that of the model.
            is_canceled: Whether the plan is canceled, which ends a search at once.

        Raises:
            PlanningError: The request is refused, or no motion was found in time.
        """
        began = self._clock()
        scene = self._model.scene if scene is None else scene
        self._refuse(request)
        if request.planner_id in PLANNER_IDS:
            plan = self._industrial.plan(request, self._checked_in(scene))
        else:
            plan = self._free_motion(request, scene, began + request.timeout, is_canceled)
        return replace(plan, planning_time=self._clock() - began)

    def plan_sequence(
        self, items: Sequence[SequenceItem], scene: PlanningScene | None = None, first: int = 0
    ) -> MotionPlan:
        """Return one motion through several of PTP, LIN and CIRC, blended where they say so.

        Args:
            items: The motions; each begins where the one before ends.
            scene: What may collide; by default that of the model.
            first: Number of the first item, for messages.

        Raises:
            PlanningError: A motion is refused, or a blend; the message names the item.
        """
        began = self._clock()
        scene = self._model.scene if scene is None else scene
        plan = self._industrial.plan_sequence(items, self._checked_in(scene), first)
        return replace(plan, planning_time=self._clock() - began)

    def ik(
        self,
        pose: Pose,
        seed: Sequence[float] | Array,
        *,
        link: str = '',
        scene: PlanningScene | None = None,
        timeout: float = DEFAULT_TIMEOUT,
        count: int = 1,
    ) -> list[Array]:
        """Return joint positions for a pose that are free of contact, nearest to the seed first.

        Args:
            pose: Where the link is wanted, in the root link.
            seed: Joint positions in [rad] (n), of which solutions are wanted near.
            link: The link; empty for the tip.
            scene: What may collide; by default that of the model.
            timeout: Time for the search of an arm without closed form in [s].
            count: How many solutions end that search.

        Raises:
            PlanningError: There is no solution, and why; or a number is not finite.
        """
        scene = self._model.scene if scene is None else scene
        try:
            return self._solver(link).solve(pose, seed, scene, timeout, count)
        except CommandError as error:
            raise PlanningError(PlanningCode.INVALID_GOAL_CONSTRAINTS, str(error)) from error

    def is_valid(
        self, positions: Sequence[float] | Array, scene: PlanningScene | None = None
    ) -> Violation | None:
        """Return why the arm may not be somewhere; None where it may.

        Args:
            scene: What may collide; by default that of the model.

        Raises:
            PlanningError: They are not finite numbers, one for each joint.
        """
        state = self._state(positions, 'state', PlanningCode.INVALID_ROBOT_STATE)
        return self._checked_in(self._model.scene if scene is None else scene).state(state)

    def fk(self, positions: Sequence[float] | Array, link: str = '') -> Pose:
        """Return the pose of a link in the root link.

        Args:
            link: The link; empty for the tip.

        Raises:
            PlanningError: There is no such link, or the positions are not finite numbers.
        """
        state = self._state(positions, 'state', PlanningCode.INVALID_ROBOT_STATE)
        try:
            self._model.check_link(link or None)
        except CommandError as error:
            raise PlanningError(PlanningCode.INVALID_LINK_NAME, str(error)) from error
        return self._model.kinematics.link_pose(link or self._model.tip, state)

    def _free_motion(
        self,
        request: MotionRequest,
        scene: PlanningScene,
        deadline: float,
        is_canceled: Callable[[], bool],
    ) -> MotionPlan:
        """Return the quickest of the free motions that are found in as many attempts.

        Constraints make a search so slow that the first one counts.
        """

        def left() -> float:
            if is_canceled():
                raise PlanningError(PlanningCode.PREEMPTED, CANCELED)
            return deadline - self._clock()

        def expired() -> bool:
            return left() < 0.0

        check = self._checked_in(scene)
        start = self._state(request.start, 'start', PlanningCode.INVALID_ROBOT_STATE)
        check.refuse_start(start)
        constraints = None
        if request.constraints is not None:
            constraints = ConstraintCheck(self._model, request.constraints)
            _require_start(constraints, start)
        goals = self._goals(request, start, check, constraints, left)
        limits = self._model.limits.scaled(request.velocity_scaling, request.acceleration_scaling)
        free = FreeMotion(limits, check, self._draw, constraints)
        further = self._further(request.goals, start, check, constraints)
        paths = [free.plan(start, goals, expired, further)]
        with suppress(PlanningError):  # no time is left for further attempts
            while constraints is None and len(paths) < request.attempts:
                paths.append(free.plan(start, goals, expired, further))
        notes: tuple[str, ...] = ()
        if request.max_cartesian_speed:
            link, most = (
                self._solver(request.cartesian_speed_link).link,
                request.max_cartesian_speed,
            )
            limited = [speed_limited(path, link, most) for path in paths]
            quickest, notes = min(limited, key=lambda each: each[0].duration)
        else:
            quickest = min(paths, key=lambda path: path.duration)
        return MotionPlan(quickest, request.planner_id or DEFAULT_PLANNER, notes)

    def _solver(self, link: str) -> IkSolver:
        if link not in self._solvers:
            self._solvers[link] = IkSolver(self._model, link, self._clock, self._draw)
        return self._solvers[link]

    def _checked_in(self, scene: PlanningScene) -> ValidityCheck:
        if self._check is None or self._check.scene is not scene:
            self._check = ValidityCheck(self._model.limits, scene)
        return self._check

    def _state(self, positions: Sequence[float] | Array, what: str, code: PlanningCode) -> Array:
        try:
            return checked(positions, len(self._model), what)
        except CommandError as error:
            raise PlanningError(code, str(error)) from error

    def _goals(
        self,
        request: MotionRequest,
        start: Array,
        check: ValidityCheck,
        constraints: ConstraintCheck | None,
        left: Callable[[], float],
    ) -> list[Array]:
        """Return the states of all goals that are valid, or raise what is wrong with the first."""
        found: list[Array] = []
        for goal in request.goals:
            if left() < 0.0:
                break
            with suppress(PlanningError):
                found += self._states(goal, start, check, constraints, DEFAULT_TIMEOUT)
        if found:
            return found
        refused: PlanningError | None = None
        for goal in request.goals:  # as long as it takes
            timeout = left()
            if refused is not None and timeout < 0.0:
                break
            try:
                return self._states(goal, start, check, constraints, max(timeout, DEFAULT_TIMEOUT))
            except PlanningError as error:
                refused = refused or error
        raise refused or PlanningError(PlanningCode.INVALID_GOAL_CONSTRAINTS, 'no goal')

    def _states(
        self,
        goal: Goal,
        start: Array,
        check: ValidityCheck,
        constraints: ConstraintCheck | None,
        timeout: float,
    ) -> list[Array]:
        """Return the states of a goal, which are valid and heed path constraints."""
        try:
            states = _heeding(constraints, self._exact_states(goal, start, check, timeout))
        except PlanningError as error:
            if error.code not in _NOT_EXACTLY:
                raise
            tried = islice(self._tolerated(goal, start, check, constraints), GOAL_SAMPLES)
            found = (state for state in tried if state is not None)
            states = list(islice(found, IK_SOLUTIONS))
            if not states:
                raise
        return states

    def _exact_states(
        self, goal: Goal, start: Array, check: ValidityCheck, timeout: float
    ) -> list[Array]:
        """Return the states at a goal itself, which are valid."""
        if isinstance(goal, JointGoal):
            state = self._state(goal.positions, 'goal', PlanningCode.INVALID_GOAL_CONSTRAINTS)
            state = self._model.limits.in_nearest_turn(state, start)
            _require_goal(check.state(state))
            return [frozen(state)]
        wanted = IK_SOLUTIONS if timeout == DEFAULT_TIMEOUT else 1
        states = self.ik(
            goal.pose, start, link=goal.link, scene=check.scene, timeout=timeout, count=wanted
        )
        valid = [state for state in states if check.state(state) is None]
        if not valid:
            _require_goal(check.state(states[0]))
        return valid

    def _further(
        self,
        goals: Sequence[Goal],
        start: Array,
        check: ValidityCheck,
        constraints: ConstraintCheck | None,
    ) -> Iterator[Array | None]:
        """Yield further states of poses without end, None where a try found none."""
        sources = [
            source(goal, start, check, constraints)
            for goal in goals
            if isinstance(goal, PoseGoal)
            for source in (self._solutions, self._tolerated)
        ]
        while sources:
            yield from (next(each, None) for each in sources)

    def _solutions(
        self,
        goal: PoseGoal,
        start: Array,
        check: ValidityCheck,
        constraints: ConstraintCheck | None,
    ) -> Iterator[Array | None]:
        """Yield further solutions of a pose without end, None where a start led to none."""
        if self._solver(goal.link).closed_form is not None:
            return  # all are known
        while True:
            state = self._solver(goal.link).another(goal.pose, start)
            yield self._valid(state, check, constraints)

    def _valid(
        self, state: Array | None, check: ValidityCheck, constraints: ConstraintCheck | None
    ) -> Array | None:
        """Return a state that is valid and heeds constraints, else None."""
        if state is None or check.state(state) is not None:
            return None
        return state if constraints is None or constraints.heeds(state) else None

    def _tolerated(
        self, goal: Goal, start: Array, check: ValidityCheck, constraints: ConstraintCheck | None
    ) -> Iterator[Array | None]:
        """Yield states within the tolerances of a goal without end, None where a try found none.

        The first are near to the start, the others anywhere.
        """
        limits = self._model.limits
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
        others = () if constraints is None else constraints.constraints
        within, near = (
            ConstraintCheck(self._model, tolerances, *others),
            np.clip(start, lower, upper),
        )
        for number in count():
            share = min(number / GOAL_SAMPLES, 1.0)
            drawn = near + share * (self._draw.uniform(lower, upper) - near)
            state = within.projected(drawn, rooms=0.0)
            yield self._valid(None if state is None else frozen(state), check, constraints)

    def _refuse(self, request: MotionRequest) -> None:
        """Raise what is wrong with a request before anything is computed."""
        if request.planner_id not in ('', *FREE_MOTION, *PLANNER_IDS):
            raise unknown_planner(request.planner_id, FREE_MOTION)
        if not request.goals:
            raise PlanningError(PlanningCode.INVALID_GOAL_CONSTRAINTS, 'the request has no goal')
        for name in ('velocity_scaling', 'acceleration_scaling'):
            value = getattr(request, name)
            if not 0.0 < value <= 1.0:
                raise PlanningError(
                    PlanningCode.FAILURE, f'{name} is {value}; it must be above 0 and up to 1'
                )


def _require_start(constraints: ConstraintCheck, start: Array) -> None:
    """Raise why free motion cannot begin under path constraints."""
    constraints.refuse_narrow(start)
    if not constraints.heeds(start):
        raise PlanningError(
            PlanningCode.START_STATE_VIOLATES_PATH_CONSTRAINTS,
            f'start: {constraints.reason(start)}; begin where the constraint holds',
        )


def _heeding(constraints: ConstraintCheck | None, goals: list[Array]) -> list[Array]:
    """Return the goals that heed path constraints, or raise why none does."""
    if constraints is None:
        return goals
    found = [goal for goal in goals if constraints.heeds(goal)]
    if not found:
        raise PlanningError(
            PlanningCode.GOAL_VIOLATES_PATH_CONSTRAINTS,
            f'goal: {constraints.reason(goals[0])}; choose a goal where the constraint holds',
        )
    return found


def unknown_planner(planner_id: str, planner_ids: Sequence[str]) -> PlanningError:
    """Return the refusal of a planner that there is not."""
    known = ', '.join((*planner_ids, *PLANNER_IDS))
    return PlanningError(
        PlanningCode.FAILURE, f'unknown planner_id {planner_id!r}; choose one of {known}'
    )


def _require_goal(violation: Violation | None) -> None:
    """Raise what is wrong with a goal: a limit, or a contact."""
    if violation is not None:
        code = _GOAL_CODES[violation.contact is not None]
        raise PlanningError(code, f'goal: {violation.reason}')


_GOAL_CODES = (PlanningCode.GOAL_STATE_INVALID, PlanningCode.GOAL_IN_COLLISION)
_NOT_EXACTLY = (
    *_GOAL_CODES,
    PlanningCode.NO_IK_SOLUTION,
    PlanningCode.GOAL_VIOLATES_PATH_CONSTRAINTS,
)
"""Of goals that may be reached within their tolerances all the same."""
