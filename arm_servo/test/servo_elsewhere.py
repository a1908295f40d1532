# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An ideal arm behind the standalone loop, cycle by cycle."""

from __future__ import annotations

from collections import deque
from concurrent.futures import Executor

from model_robots import ready, robot
import numpy as np
from servo_commands import InlineWorker
from servo_commands import jog as jog_joints

from arm_model import Array
from arm_servo import MotionCore, SetPoint
from arm_servo.core.gateway import CommandGateway
from arm_servo.io.following import FollowingLimits, FollowingWatch
from arm_servo.io.motion_thread import JointFeedback, MotionCycle
from arm_trajectory import GoalPoint, TrajectoryGoal

PERIOD = 0.01


class Elsewhere:
    """An arm whose drives take set-points, and publish their state.

    Attributes:
        at: Where it is in [rad].
        is_published: Whether its state is published.
        moves: Whether it goes to set-points.
        delay: How many set-points it is behind.
        sag: How far it stands below its set-points in [rad].
        points: All set-points so far.
    """

    def __init__(
        self, following: FollowingLimits | None = None, worker: Executor | None = None
    ) -> None:
        model = robot('gp110')
        self.now = 50.0
        self.at = np.array(ready('gp110'))
        self.is_published = True
        self.moves = True
        self.delay = 0
        self.sag = 0.0
        self.points: list[SetPoint] = []
        self._way: deque[Array] = deque()
        self.gateway = CommandGateway(
            MotionCore(model), worker or InlineWorker(), lambda: self.now
        )
        self.feedback = JointFeedback(model.joints, 0.2)
        watch = FollowingWatch(model.limits, following or FollowingLimits(), PERIOD)
        self.cycle = MotionCycle(self.gateway, self.feedback, self.take, watch)

    def take(self, point: SetPoint) -> None:
        """Go to a set-point, at once or some cycles later."""
        self.points.append(point)
        self._way.append(np.array(point.state.position))
        while len(self._way) > self.delay:
            here = self._way.popleft()
            self.at = here if self.moves else self.at

    def run(self, cycles: int = 1) -> None:
        """Run some cycles."""
        for _ in range(cycles):
            self.now += PERIOD
            if self.is_published:
                at = (self.at - self.sag).tolist()
                self.feedback.receive(self.gateway.model.joints, at, [], self.now)
            self.cycle.step(self.now, PERIOD)

    def path(self) -> Array:
        """Return the positions commanded so far, a row for each."""
        return np.array([point.state.position for point in self.points])


def swing(arm: Elsewhere, far: float = 0.3) -> TrajectoryGoal:
    """Return a trajectory of all joints."""
    return TrajectoryGoal(arm.gateway.model.joints, [GoalPoint(2.0, (arm.at + far).tolist())])


def jog(arm: Elsewhere, cycles: int, speed: float = 0.5) -> list[str]:
    """Jog the first joint with a command in each cycle; return why commands were refused."""
    refusals = []
    for _ in range(cycles):
        future = jog_joints(arm.gateway, {'joint_1_s': speed}, arm.now)
        arm.run()
        if (error := future.exception(0.0)) is not None:
            refusals.append(str(error))
    return refusals
