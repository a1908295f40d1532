# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The entry point: plans each request with the pipeline that its planner_id selects."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
import time

import numpy as np

from arm_model import Array, checked, PlanningScene, Pose, RobotModel

from .constraints import ConstraintCheck
from .exceptions import coded, PlanningCode, PlanningError
from .free_motion import FreeMotion, GoalStates
from .ik import DEFAULT_TIMEOUT, IkSolver
from .pilz_motions import CartesianLimits
from .pilz_planner import PilzPlanner, PLANNER_IDS, SequenceItem
from .requests import check_scaling, MotionPlan, MotionRequest
from .retime import speed_limited
from .validity import ValidityCheck, Violation

FREE_MOTION = ('RRTConnectkConfigDefault', 'RRTConnect', 'geometric::RRTConnect')
"""MoveIt and OMPL planner ids that select the free-motion planner."""
CANCELED = 'canceled while it was planned'  # why a plan was not found
DEFAULT_PLANNER = FREE_MOTION[0]  # what plans a request without a planner_id


class Planner:
    """Motion planner of one arm. Not thread-safe: use each instance from one thread."""

    def __init__(
        self,
        model: RobotModel,
        cartesian_limits: CartesianLimits | None = None,
        clock: Callable[[], float] = time.monotonic,
        seed: int = 0,
    ) -> None:
        """Prepare.

        Args:
            model: The arm; calls without a scene use the scene of the model.
            clock: Returns the steady time in [s], for time-outs.
            seed: Random seed: the same seed gives the same plans if no search times out.
        """
        self._model, self._clock = model, clock
        self._draw = np.random.default_rng(seed)
        self._solver = cache(lambda link: IkSolver(model, link or model.tip, clock, self._draw))
        self._industrial = PilzPlanner(model, cartesian_limits, self._solver)
        self._check: ValidityCheck | None = None

    def plan(
        self,
        request: MotionRequest,
        scene: PlanningScene | None = None,
        is_canceled: Callable[[], bool] = lambda: False,
    ) -> MotionPlan:
        """Plan a motion that is valid along its whole path.

        Args:
            scene: Planning scene; by default that of the model.
            is_canceled: Returns whether the request is canceled; if so, the search ends at once.

        Raises:
            PlanningError: The request is refused, or no motion was found in time.
        """
        began = self._clock()
        scene = self._model.scene if scene is None else scene
        if request.planner_id not in ('', *FREE_MOTION, *PLANNER_IDS):
            raise unknown_planner(request.planner_id, FREE_MOTION)
        if not request.goals:
            raise PlanningError(PlanningCode.INVALID_GOAL_CONSTRAINTS, 'the request has no goal')
        check_scaling(request)
        if request.planner_id in PLANNER_IDS:
            plan = self._industrial.plan(request, self._checked_in(scene))
        else:
            plan = self._free_motion(request, scene, began + request.timeout, is_canceled)
        return replace(plan, planning_time=self._clock() - began)

    def plan_sequence(
        self, items: Sequence[SequenceItem], scene: PlanningScene | None = None, first: int = 0
    ) -> MotionPlan:
        """Plan one motion through a sequence of PTP, LIN and CIRC, with blends where requested.

        Args:
            items: The motions; each begins where the previous one ends.
            scene: Planning scene; by default that of the model.
            first: Number of the first item, for messages.

        Raises:
            PlanningError: A motion or a blend is refused; the message names the item.
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
        """Return collision-free IK solutions for a pose, the nearest to the seed first.

        Args:
            pose: Target pose of the link, in the root link.
            seed: Joint positions in [rad] (n) near which to search.
            link: The link; empty for the tip.
            scene: Planning scene; by default that of the model.
            timeout: Time limit in [s] of the numeric search, for arms without a closed form.
            count: Number of solutions after which the numeric search ends.

        Raises:
            PlanningError: No solution (the message says why), or a number is not finite.
        """
        scene = self._model.scene if scene is None else scene
        return self._solver(link).solve(pose, seed, scene, timeout, count)

    def is_valid(
        self, positions: Sequence[float] | Array, scene: PlanningScene | None = None
    ) -> Violation | None:
        """Return why a joint state is not valid; None if it is valid.

        Args:
            scene: Planning scene; by default that of the model.

        Raises:
            PlanningError: The positions are not one finite number for each joint.
        """
        check = self._checked_in(self._model.scene if scene is None else scene)
        return check.state(self._numbers(positions))

    def fk(self, positions: Sequence[float] | Array, link: str = '') -> Pose:
        """Return the pose of a link in the root link.

        Args:
            link: The link; empty for the tip.

        Raises:
            PlanningError: The link is unknown, or the positions are not finite numbers.
        """
        state = self._numbers(positions)
        with coded(PlanningCode.INVALID_LINK_NAME):
            self._model.check_link(link or None)
        return self._model.kinematics.link_pose(link or self._model.tip, state)

    def _free_motion(
        self,
        request: MotionRequest,
        scene: PlanningScene,
        deadline: float,
        is_canceled: Callable[[], bool],
    ) -> MotionPlan:
        """Plan as many free motions as the request has attempts; return the quickest.

        With path constraints, searches are so slow that the first motion is returned.
        """

        def left() -> float:
            if is_canceled():
                raise PlanningError(PlanningCode.PREEMPTED, CANCELED)
            return deadline - self._clock()

        def expired() -> bool:
            return left() < 0.0

        check = self._checked_in(scene)
        start = check.start(request.start)
        constraints = None
        if request.constraints is not None:
            constraints = ConstraintCheck(self._model, request.constraints)
            constraints.refuse_narrow(start)
            if not constraints.heeds(start):
                raise PlanningError(
                    PlanningCode.START_STATE_VIOLATES_PATH_CONSTRAINTS,
                    f'start: {constraints.reason(start)}; begin where the constraint holds',
                )
        states = GoalStates(
            self._model,
            self._solver,
            self._draw,
            start=start,
            check=check,
            constraints=constraints,
        )
        goals = states.first(request.goals, left)
        limits = self._model.limits.scaled(request.velocity_scaling, request.acceleration_scaling)
        free = FreeMotion(limits, check, self._draw, constraints)
        further = states.further(request.goals)
        paths = [free.plan(start, goals, expired, further)]
        with suppress(PlanningError):  # no time is left for further attempts
            while constraints is None and len(paths) < request.attempts:
                paths.append(free.plan(start, goals, expired, further))
        speed, link = request.max_cartesian_speed, request.cartesian_speed_link
        limited = [speed_limited(path, speed, link, self._solver) for path in paths]
        quickest, notes = min(limited, key=lambda each: each[0].duration)
        return MotionPlan(quickest, request.planner_id or DEFAULT_PLANNER, notes)

    def _checked_in(self, scene: PlanningScene) -> ValidityCheck:
        if self._check is None or self._check.scene is not scene:
            self._check = ValidityCheck(self._model.limits, scene)
        return self._check

    def _numbers(self, positions: Sequence[float] | Array) -> Array:
        with coded(PlanningCode.INVALID_ROBOT_STATE):
            return checked(positions, len(self._model), 'state')


def unknown_planner(planner_id: str, planner_ids: Sequence[str]) -> PlanningError:
    """Return the error for an unknown planner."""
    known = ', '.join((*planner_ids, *PLANNER_IDS))
    return PlanningError(
        PlanningCode.FAILURE, f'unknown planner_id {planner_id!r}; choose one of {known}'
    )
