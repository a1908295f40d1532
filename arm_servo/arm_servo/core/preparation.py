# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motions planned and checked beside the cycle, from what that hands out."""

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

Motion = Execution | SingleTarget  # what has a goal, and an outcome once it ended


@dataclass(frozen=True, slots=True)
class CoreSettings:
    """How the core behaves."""

    servo: ServoSettings = field(default_factory=ServoSettings)  # how jogging behaves
    # how trajectories are followed
    execution: ExecutionSettings = field(default_factory=ExecutionSettings)
    # least distance between links that a jog and its stop may bring about in [m]; None is any
    clearance: float | None = 0.005
    # whether a trajectory or a single target is refused on whose way links meet
    check_self_collision: bool = True


@dataclass(frozen=True, slots=True, eq=False)
class PreparedScene:
    """What measures a scene: one thing for each thread."""

    clearances: Clearances  # of the cycle
    # looks for contact on paths, in the thread that prepares motions; None without such checks
    check: PathCheck | None


@dataclass(frozen=True, slots=True, eq=False)
class CommandBasis:
    """What the cycle knows when a command is prepared."""

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
        """Return the basis some time later, when nothing comes in between."""
        if self.source is Source.TRAJECTORY and self.execution is not None:
            return replace(self, state=self.execution.foreseen(ahead, self.timer))
        state = self.state
        there = state.position + ahead * state.velocity
        return replace(self, state=RobotState(there, state.velocity, 0.0 * state.acceleration))


class Preparation:
    """Plans motions, and looks for collisions on their paths; for one thread.

    A trajectory takes 2 ms, 0.2 ms a point, and about 3 ms for each second of its path.
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
        """Return where displacements lead, beyond where the arm is going already."""
        values, moved = by_joint(self._model, displacements, 'displacements')
        if basis.target is not None:
            ends: Array = basis.target + values
            return ends
        return self._aimed(basis.state.position + values, moved, basis)

    def _aimed(self, positions: Array, moved: Mask, basis: CommandBasis) -> Array:
        """Return positions of the joints that are moved, and where the others come to rest."""
        rest, limits = self._generator.brake(basis.state), self._limits
        stay = basis.state.position if rest is None else rest.at(rest.duration).position
        # where a joint comes to rest was not asked for: it need not be refused
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
            GoalError: It is refused.
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
        """Return a goal that begins now or after a wait, where it begins, and the wait in [s].

        What begins later begins where the arm will have come to rest; where there is no time for
        that, the motion goes over into it, so that its points are met at their times.
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
