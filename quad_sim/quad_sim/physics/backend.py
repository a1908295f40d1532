# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot in physics as a back end, in virtual time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from quad_description import Backend, ImuSample, JointSample, RobotState
from quad_description.rotations import from_rpy, Quaternion, Vector

from .robot import Robot

PERIOD = 0.02  # [s]


@dataclass(frozen=True, slots=True)
class ImuBias:
    """By how much an IMU is off all the time."""

    gyro: Vector = (0.0, 0.0, 0.0)  # of each axis of the gyro in [rad/s]
    roll: float = 0.0  # of the measured attitude in [rad]
    pitch: float = 0.0  # of the measured attitude in [rad]

    def orientation(self, roll: float, pitch: float, yaw: float) -> Quaternion:
        """Return what is measured of an attitude [rad]."""
        return from_rpy(roll + self.roll, pitch + self.pitch, yaw)

    def rates(self, angular_velocity: Vector) -> Vector:
        """Return what is measured of an angular velocity [rad/s]."""
        x, y, z = (a + b for a, b in zip(angular_velocity, self.gyro, strict=True))
        return x, y, z


class PhysicsBackend(Backend):
    """Has a robot followed by ideal sensors: no noise, and its position is known.

    Attributes:
        robot: The robot, to push it or to look at it.
    """

    def __init__(
        self,
        robot: Robot,
        period: float = PERIOD,
    ) -> None:
        """Observe a robot."""
        self.robot, self.period = robot, period
        self.names = robot.joint_names

    def reset(self) -> RobotState:
        """Stand on the ground again."""
        self.robot.reset()
        return self.observe()

    def step(self, targets: Sequence[float] | None) -> RobotState:
        """Send targets, and let a period pass.

        Raises:
            SimulationError: A target is not finite, or the physics blew up.
        """
        if targets is not None:
            self.robot.set_targets(targets)
        self.robot.step(self.period)
        return self.observe()

    def observe(self) -> RobotState:
        """Return the true state."""
        robot = self.robot
        pose = robot.base_pose
        positions, velocities = robot.joint_positions, robot.joint_velocities
        return RobotState(
            JointSample(tuple(positions.tolist()), tuple(velocities.tolist()), robot.time),
            ImuSample(pose.orientation, robot.base_velocity.angular, robot.imu.specific_force),
            position=pose.position,
            linear_velocity=robot.base_velocity.linear,
            foot_contacts=robot.foot_contacts,
            time=robot.time,
        )

    def close(self) -> None:
        """Do nothing: the robot is memory."""
