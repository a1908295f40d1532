# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot in physics as a back end, in virtual time."""

from __future__ import annotations

from collections.abc import Sequence

from quad_description import Backend, ImuSample, JointSample, RobotState

from .robot import Robot

PERIOD = 0.02  # [s]


class PhysicsBackend(Backend):
    """Has a robot followed by ideal sensors: no noise, no delay, and its position is known.

    Attributes:
        robot: The robot, to push it or to look at it.
    """

    def __init__(self, robot: Robot, period: float = PERIOD) -> None:
        """Observe a robot.

        Args:
            robot: The robot.
            period: Time that a step takes in [s].
        """
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
            time=robot.time,
        )

    def close(self) -> None:
        """Do nothing: the robot is memory."""
