# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The way in: a request becomes a plan, by the pipeline that its planner_id names."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
import time

import numpy as np

from arm_model import Array, checked, CommandError, PlanningScene, Pose, RobotModel

from .exceptions import PlanningCode, PlanningError
from .free.free_motion import FreeMotion
from .free.timing import scaled_limits
from .requests import Goal, JointGoal, MotionPlan, MotionRequest
from .validity import ValidityCheck, Violation

FREE_MOTION = ('RRTConnectkConfigDefault', 'RRTConnect', 'geometric::RRTConnect')
"""Names of MoveIt and OMPL for the planner of free motion."""

DEFAULT_PLANNER = FREE_MOTION[0]
"""What plans a request without a planner_id."""


class Planner:
    """Plans motions of one arm; belongs to one thread."""

    def __init__(
        self,
        model: RobotModel,
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
        self._check: ValidityCheck | None = None

    def plan(self, request: MotionRequest, scene: PlanningScene | None = None) -> MotionPlan:
        """Return a motion that is valid everywhere.

        Args:
            request: What is asked for.
            scene: What may collide; by default that of the model.

        Raises:
            PlanningError: The request is refused, or no motion was found in time.
        """
        began = self._clock()
        self._refuse(request)
        check = self._checked_in(scene)
        start = self._state(request.start, 'start', PlanningCode.INVALID_ROBOT_STATE)
        _require(check.state(start), 'start', _START_CODES)
        goals = self._goals(request.goals, check)
        limits = scaled_limits(
            self._model.limits, request.velocity_scaling, request.acceleration_scaling
        )
        free = FreeMotion(limits, check, self._draw)
        deadline = began + request.timeout

        def expired() -> bool:
            return self._clock() > deadline

        paths = [free.plan(start, goals, expired)]
        with suppress(PlanningError):  # no time is left for further attempts
            while len(paths) < request.attempts:
                paths.append(free.plan(start, goals, expired))
        quickest = min(paths, key=lambda path: path.duration)
        name = request.planner_id or DEFAULT_PLANNER
        return MotionPlan(quickest, name, planning_time=self._clock() - began)

    def is_valid(
        self, positions: Sequence[float] | Array, scene: PlanningScene | None = None
    ) -> Violation | None:
        """Return why the arm may not be somewhere; None where it may.

        Args:
            positions: Joint positions in [rad] (n).
            scene: What may collide; by default that of the model.

        Raises:
            PlanningError: They are not finite numbers, one for each joint.
        """
        state = self._state(positions, 'state', PlanningCode.INVALID_ROBOT_STATE)
        return self._checked_in(scene).state(state)

    def fk(self, positions: Sequence[float] | Array, link: str = '') -> Pose:
        """Return the pose of a link in the root link.

        Args:
            positions: Joint positions in [rad] (n).
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

    def _checked_in(self, scene: PlanningScene | None) -> ValidityCheck:
        scene = self._model.scene if scene is None else scene
        if self._check is None or self._check.scene is not scene:
            self._check = ValidityCheck(self._model.limits, scene)
        return self._check

    def _state(self, positions: Sequence[float] | Array, what: str, code: PlanningCode) -> Array:
        try:
            return checked(positions, len(self._model), what)
        except CommandError as error:
            raise PlanningError(code, str(error)) from error

    def _goals(self, goals: Sequence[Goal], check: ValidityCheck) -> list[Array]:
        """Return the goals that are valid, or raise what is wrong with the first."""
        found = []
        for goal in goals:
            with suppress(PlanningError):
                found.append(self._joint_goal(goal, check))
        return found or [self._joint_goal(goals[0], check)]

    def _joint_goal(self, goal: Goal, check: ValidityCheck) -> Array:
        if not isinstance(goal, JointGoal):
            raise PlanningError(
                PlanningCode.UNRECOGNIZED_GOAL_TYPE, 'free motion needs a goal in joint space'
            )
        state = self._state(goal.positions, 'goal', PlanningCode.INVALID_GOAL_CONSTRAINTS)
        _require(check.state(state), 'goal', _GOAL_CODES)
        return state

    def _refuse(self, request: MotionRequest) -> None:
        """Raise what is wrong with a request before anything is computed."""
        if request.planner_id not in ('', *FREE_MOTION):
            known = ', '.join(FREE_MOTION)
            raise PlanningError(
                PlanningCode.FAILURE,
                f'unknown planner_id {request.planner_id!r}; choose one of {known}',
            )
        if not request.goals:
            raise PlanningError(PlanningCode.INVALID_GOAL_CONSTRAINTS, 'the request has no goal')
        if request.constraints is not None:
            raise PlanningError(
                PlanningCode.PLANNING_FAILED, 'free motion does not heed path constraints'
            )
        for name in ('velocity_scaling', 'acceleration_scaling'):
            value = getattr(request, name)
            if not 0.0 < value <= 1.0:
                raise PlanningError(
                    PlanningCode.FAILURE, f'{name} is {value}; it must be above 0 and up to 1'
                )


def _require(
    violation: Violation | None, what: str, codes: tuple[PlanningCode, PlanningCode]
) -> None:
    """Raise what is wrong with a start or a goal: a limit, or a contact."""
    if violation is not None:
        code = codes[violation.contact is not None]
        raise PlanningError(code, f'{what}: {violation.reason}')


_START_CODES = (PlanningCode.START_STATE_INVALID, PlanningCode.START_STATE_IN_COLLISION)
_GOAL_CODES = (PlanningCode.GOAL_STATE_INVALID, PlanningCode.GOAL_IN_COLLISION)
