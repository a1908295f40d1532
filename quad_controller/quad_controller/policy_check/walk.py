# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A walk on any back end, through the same controller that runs on the robot."""

from __future__ import annotations

from dataclasses import dataclass
import math

from quad_description import Backend, Quadruped, RobotState

from ..gait.parameters import GaitParameters
from ..gait.velocity import REST, Velocity
from ..policy.interface import Policy
from ..states.controller import Controller
from ..states.modes import State
from ..states.parameters import StateParameters

STAND_TIME = 2.5  # [s] to stand up, and for the policy to take over
SETTLE_TIME = 1.5  # [s] to take up speed


@dataclass(frozen=True, slots=True)
class Walked:
    """How a walk went.

    Attributes:
        velocity: Mean velocity in the robot's own frame.
        tilt: Largest angle between the body's z axis and up in [rad].
        trouble: Why it ended early; empty when it did not.
    """

    velocity: Velocity
    tilt: float
    trouble: str


class WalkingRobot:
    """A back end and the controller that walks it.

    Attributes:
        controller: The controller.
        tilt: Largest tilt so far in [rad].
        travelled: Way and turning so far, in the robot's own frame, in [m] and [rad].
    """

    def __init__(self, backend: Backend, robot: Quadruped, policy: Policy) -> None:
        """Put the robot on the ground.

        Args:
            backend: Where the robot is; it has to know its position.
            robot: The model of the robot.
            policy: What the mode ``policy`` follows.
        """
        self._backend, self._state = backend, backend.reset()
        states = StateParameters(period=backend.period)
        self.controller = Controller(robot, GaitParameters(), states, policy=policy)
        self.tilt = 0.0
        self.travelled = REST

    def run(self, duration: float, velocity: Velocity) -> None:
        """Pass some time [s] with a velocity that is commanded."""
        for _ in range(round(duration / self._backend.period)):
            self.step(velocity)

    def step(self, velocity: Velocity) -> None:
        """Pass one period with a velocity that is commanded."""
        self.controller.set_velocity(velocity)
        output = self.controller.step(self._state, self._backend.period)
        before, self._state = self._state, self._backend.step(output.targets)
        self._add_way(before, self._state)

    def _add_way(self, before: RobotState, after: RobotState) -> None:
        if before.imu is None or after.imu is None or not before.position or not after.position:
            return
        way, heading = self.travelled, before.imu.roll_pitch_yaw[2]
        dx, dy = (b - a for a, b in zip(before.position[:2], after.position[:2], strict=True))
        self.tilt = max(self.tilt, after.imu.tilt)
        self.travelled = Velocity(
            way.x + dx * math.cos(heading) + dy * math.sin(heading),
            way.y + dy * math.cos(heading) - dx * math.sin(heading),
            way.yaw + math.remainder(after.imu.roll_pitch_yaw[2] - heading, math.tau),
        )


def walk(
    backend: Backend, robot: Quadruped, policy: Policy, velocity: Velocity, duration: float
) -> Walked:
    """Let a policy walk.

    Args:
        backend: Where the robot is; it has to know its position.
        robot: The model of the robot.
        policy: What walks; it has been checked.
        velocity: What is commanded.
        duration: How long in [s].
    """
    walker = WalkingRobot(backend, robot, policy)
    walker.step(REST)  # modes are refused before the robot is known
    walker.controller.set_mode(State.POLICY.value)
    walker.run(STAND_TIME, REST)
    walker.run(SETTLE_TIME, velocity)
    walker.travelled = REST
    walker.run(duration, velocity)
    status = walker.controller.status
    trouble = '; '.join(status.faults)
    if not trouble and status.state is not State.POLICY:
        trouble = f'the policy was left for {status.state.value}'
    return Walked(walker.travelled.scaled(1.0 / duration), walker.tilt, trouble)
