# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is found out about a motion before it begins, beside the cycle."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .arrays import Array
from .core_settings import CoreSettings
from .exceptions import CommandError, GoalCode, GoalError
from .execution import Execution
from .goal import TrajectoryGoal
from .model import RobotModel
from .otg import Generator, MotionState
from .path_check import PathCheck


@dataclass(frozen=True, slots=True, eq=False)
class Way:
    """The way to a single target.

    Attributes:
        state: The commanded state where it begins.
        target: Positions to rest at in [rad].
        fastest: Greatest speed of a joint in [rad/s].
        turn: Number of commands before it; another one makes it void.
    """

    state: MotionState
    target: Array
    fastest: float
    turn: int


class Planning:
    """Plans trajectories, and looks for collisions on the ways of motions; for one thread.

    It takes 2 ms, 0.2 ms a point, and about 3 ms for each second of a path.
    """

    def __init__(self, model: RobotModel, follower: Generator, settings: CoreSettings) -> None:
        """Prepare.

        Args:
            model: The arm.
            follower: Plans how executions catch up; used in the cycle only.
            settings: How the core behaves.
        """
        self._limits = model.limits
        self._follower = follower
        self._settings = settings
        self._generator = Generator(model.limits)  # that of the cycle is for the cycle
        self._check = PathCheck(model) if settings.check_self_collision else None

    def execution(self, goal: TrajectoryGoal, state: MotionState, pace: float) -> Execution:
        """Check a trajectory, and plan its execution.

        Args:
            goal: The trajectory.
            state: The commanded state at which it will begin.
            pace: Pace to start with, 0 to 1.

        Raises:
            GoalError: It is refused.
        """
        goal, begin, wait = self._begin(goal, state)
        execution = Execution(
            goal,
            limits=self._limits,
            generator=self._follower,
            state=begin,
            pace=pace,
            settings=self._settings.execution,
            wait=wait,
        )
        path = execution.path
        found = self._check and self._check.contact(path.positions, path.duration)
        if found:
            raise GoalError(
                GoalCode.INVALID_GOAL,
                f'{" and ".join(found.links)} would collide at {found.time:.2f} s of the'
                ' trajectory; lead it around that (check_self_collision switches this off)',
            )
        return execution

    def _begin(
        self, goal: TrajectoryGoal, state: MotionState
    ) -> tuple[TrajectoryGoal, MotionState, float]:
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
            return replace(goal, age=0.0), MotionState.at_rest(there), wait
        points = [replace(point, time=point.time + wait) for point in goal.points]
        return replace(goal, points=points, age=0.0), state, 0.0

    def check(self, way: Way) -> None:
        """Make sure that no links meet on the way to a single target.

        Args:
            way: The way.

        Raises:
            CommandError: Two links meet.
        """
        plan = self._generator.to_state(way.state, MotionState.at_rest(way.target))
        if self._check is None or plan is None:
            return

        def positions(times: Array) -> Array:
            return np.array([plan.at(time).position for time in times.tolist()])

        found = self._check.contact(positions, plan.duration)
        if found:
            raise CommandError(
                f'{" and ".join(found.links)} would collide after {found.time:.2f} s on the way'
                ' to the target; go around that (check_self_collision switches this off)'
            )
