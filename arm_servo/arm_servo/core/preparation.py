# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Planning and collision checking of motions, outside the cycle."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from arm_model import (
    Array,
    Clearances,
    CommandError,
    Mask,
    RobotModel,
    RobotState,
)
from arm_trajectory import (
    GoalCode,
    GoalError,
    OnlineTrajectoryGenerator,
    PathCheck,
    TimerState,
    TrajectoryGoal,
)

from ..controllers.controller import SingleTarget, Source
from ..controllers.jog import ServoSettings
from ..controllers.trajectory import Execution, ExecutionSettings
from .requests import by_joint, check_limits, DisplacementRequest, MotionRequest

Motion = Execution | SingleTarget  # motion with a goal, and an outcome once ended


@dataclass(frozen=True, slots=True)
class CoreSettings:
    """Settings of the motion core."""

    servo: ServoSettings = field(default_factory=ServoSettings)  # how jogging behaves
    # how trajectories are followed
    execution: ExecutionSettings = field(default_factory=ExecutionSettings)
    # least distance between links that a jog and its stop may bring about in [m]; None is any
    clearance: float | None = 0.005
    # whether to refuse trajectories and single targets whose path has a collision
    check_self_collision: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class PreparedScene:
    """Collision checkers of one scene, one for each thread."""

    clearances: Clearances  # of the cycle
    # finds contact on paths, in the preparing thread; None if checks are off
    check: PathCheck | None


@dataclass(frozen=True, slots=True, eq=False)
class CommandBasis:
    """State of the cycle from which a command is prepared."""

    state: RobotState  # commanded state where the motion begins
    scene: PreparedScene  # what may collide
    sequence: int = 0  # number of commands and stops so far
    source: Source = Source.NONE  # what moves the arm
    speed_scaling: float = 1.0  # share of the speed of trajectories and targets, 0 to 1
    target: Array | None = None  # where a single target takes the arm in [rad]; None without one
    # the trajectory that was followed last; None before the first
    execution: Execution | None = None
    timer: TimerState | None = None  # how that runs; None for how it ran in its last step

    def foreseen(self, ahead: float) -> CommandBasis:
        """Predict the basis ``ahead`` [s] from now if nothing intervenes."""
        if self.source is Source.TRAJECTORY and self.execution is not None:
            return replace(self, state=self.execution.foreseen(ahead, self.timer))
        state = self.state
        there = state.position + ahead * state.velocity
        return replace(self, state=RobotState(there, state.velocity, 0.0 * state.acceleration))


class Preparation:
    """Plans motions and checks their paths for collisions; use it in one thread.

    Preparing a trajectory takes 2 ms, plus 0.2 ms per point and about 3 ms per second of its path.
    """

    def __init__(
        self, model: RobotModel, catch_up: OnlineTrajectoryGenerator, settings: CoreSettings
    ) -> None:
        self._model = model
        self._limits = model.limits
        self._catch_up = catch_up  # how executions catch up; used in the cycle only
        self._settings = settings
        self._generator = OnlineTrajectoryGenerator(
            model.limits
        )  # that of the cycle is for the cycle

    def prepare(self, request: MotionRequest, basis: CommandBasis) -> Motion:
        """Plan a motion from a state of the arm, and check its path.

        Raises:
            CommandError: The request is refused.
        """
        if isinstance(request, TrajectoryGoal):
            return self._trajectory(request, basis)
        if isinstance(request, DisplacementRequest):
            target = self._displaced(request.displacements, basis)
        else:
            target = self._aimed(*by_joint(self._model, request.positions, 'positions'), basis)
        return self._single_target(target, request.max_speed, basis)

    def _displaced(self, displacements: Mapping[str, float], basis: CommandBasis) -> Array:
        """Return the target positions of displacements, added to the current target."""
        values, moved = by_joint(self._model, displacements, 'displacements')
        if basis.target is not None:
            ends: Array = basis.target + values
            return ends
        return self._aimed(basis.state.position + values, moved, basis)

    def _aimed(self, positions: Array, moved: Mask, basis: CommandBasis) -> Array:
        """Return target positions for moved joints, and rest positions for the others."""
        rest, limits = self._generator.brake(basis.state), self._limits
        stay = basis.state.position if rest is None else rest.at(rest.duration).position
        # the rest position of a joint was not requested: do not refuse it
        target: Array = np.where(moved, positions, np.clip(stay, limits.lower, limits.upper))
        return target

    def _single_target(self, target: Array, max_speed: float, basis: CommandBasis) -> SingleTarget:
        if not max_speed > 0.0:
            raise CommandError(f'greatest speed of a joint {max_speed} rad/s: it must be above 0')
        check_limits(self._limits, target)
        motion = SingleTarget(target, max_speed, self._generator)
        plan, check = motion.plan(basis.state, basis.speed_scaling), basis.scene.check
        if check is None or plan is None:
            return motion

        def positions(times: Array) -> Array:
            return np.array([plan.at(time).position for time in times.tolist()])

        found = check.contact(positions, plan.duration)
        if found:
            raise CommandError(
                f'{" and ".join(found.links)} would collide after {found.time:.2f} s on the way'
                ' to the target; go around that (check_self_collision switches this off)'
            )
        return motion

    def _trajectory(self, goal: TrajectoryGoal, basis: CommandBasis) -> Execution:
        """Plan a trajectory and check its path.

        Raises:
            GoalError: The trajectory is refused.
        """
        goal, begin, wait = self._begin(goal, basis.state)
        execution = Execution(
            goal,
            limits=self._limits,
            generator=self._catch_up,
            state=begin,
            speed_scaling=basis.speed_scaling,
            settings=self._settings.execution,
            wait=wait,
        )
        check = basis.scene.check
        found = check and execution.contact(check)
        if found:
            raise GoalError(
                GoalCode.INVALID_GOAL,
                f'{" and ".join(found.links)} would collide at {found.time:.2f} s of the'
                ' trajectory; lead it around that (check_self_collision switches this off)',
            )
        return execution

    def _begin(
        self, goal: TrajectoryGoal, state: RobotState
    ) -> tuple[TrajectoryGoal, RobotState, float]:
        """Return the goal to plan, its start state, and the wait before it in [s].

        A goal in the future starts where the arm will have come to rest. If there is no time to
        rest, the motion blends into the goal, which keeps the times of its points.
        """
        wait = max(-goal.age, 0.0)
        if wait == 0.0 or not state.moving:
            return replace(goal, age=max(goal.age, 0.0)), state, wait
        stop = self._generator.to_velocity(state, np.zeros(len(self._limits)))
        if stop is not None and stop.duration <= wait:
            there = stop.at(stop.duration).position
            return replace(goal, age=0.0), RobotState.at_rest(there), wait
        points = [replace(point, time=point.time + wait) for point in goal.points]
        return replace(goal, points=points, age=0.0), state, 0.0
