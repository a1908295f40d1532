# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A walk in physics, through the same controller that runs on the robot."""

from __future__ import annotations

from dataclasses import dataclass
import math

from quad_description import quadruped

from ..exceptions import QuadControllerError
from ..gait.parameters import GaitParameters
from ..gait.velocity import REST, Velocity
from ..policy.interface import Policy
from ..states.controller import Controller
from ..states.measurement import ImuSample, JointSample, Measurement
from ..states.modes import State
from ..states.parameters import StateParameters

SERVOS = ('firm', 'vendor_rl')
"""Servo models of the simulation; policies of the vendor's training expect ``vendor_rl``."""

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


class Walker:
    """A robot in physics and the controller that walks it.

    Attributes:
        tilt: Largest tilt so far in [rad].
        travelled: Way and turning so far, in the robot's own frame, in [m] and [rad].
    """

    def __init__(self, urdf: str, policy: Policy, servo: str) -> None:
        """Put the robot on the ground.

        Args:
            urdf: The robot as XML text.
            policy: What the mode ``policy`` follows.
            servo: One of :data:`SERVOS`.

        Raises:
            QuadControllerError: There is no simulation.
        """
        try:
            from quad_sim import ServoModel
            from quad_sim.physics import Robot
        except ImportError as error:
            raise QuadControllerError(f'a walk needs quad_sim and MuJoCo: {error}') from error
        model, states = quadruped(urdf), StateParameters()
        self._robot, self._names = Robot(urdf, ServoModel(servo)), model.names
        self._period = states.period
        self.controller = Controller(model, GaitParameters(), states, policy=policy)
        self.tilt = 0.0
        self.travelled = REST

    def run(self, duration: float, velocity: Velocity) -> None:
        """Pass some time [s] with a velocity that is commanded."""
        for _ in range(round(duration / self._period)):
            self.step(velocity)

    def step(self, velocity: Velocity) -> None:
        """Pass one period with a velocity that is commanded."""
        robot, before = self._robot, self._robot.base_pose
        self.controller.set_velocity(velocity)
        targets = self.controller.step(self._measurement(), self._period).targets
        if targets is not None:
            robot.set_targets(dict(zip(self._names, targets, strict=True)))
        robot.step(self._period)
        after, way = robot.base_pose, self.travelled
        heading = before.roll_pitch_yaw[2]
        dx, dy = (b - a for a, b in zip(before.position[:2], after.position[:2], strict=True))
        self.tilt = max(self.tilt, after.tilt)
        self.travelled = Velocity(
            way.x + dx * math.cos(heading) + dy * math.sin(heading),
            way.y + dy * math.cos(heading) - dx * math.sin(heading),
            way.yaw + math.remainder(after.roll_pitch_yaw[2] - heading, math.tau),
        )

    def _measurement(self) -> Measurement:
        robot = self._robot
        positions, speeds = robot.joint_positions.tolist(), robot.joint_velocities.tolist()
        rate, force = robot.base_velocity.angular, robot.imu.specific_force
        return Measurement(
            JointSample(tuple(positions), tuple(speeds)),
            ImuSample(robot.base_pose.orientation, rate, force),
        )


def walk(
    urdf: str, policy: Policy, velocity: Velocity, duration: float, servo: str = SERVOS[0]
) -> Walked:
    """Let a policy walk in physics.

    Args:
        urdf: The robot as XML text.
        policy: What walks; it has been checked.
        velocity: What is commanded.
        duration: How long in [s].
        servo: One of :data:`SERVOS`.

    Raises:
        QuadControllerError: There is no simulation.
    """
    walker = Walker(urdf, policy, servo)
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
