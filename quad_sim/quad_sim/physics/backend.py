# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot in physics as a back end, in virtual time."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

from quad_description import Backend, ImuSample, JointSample, RobotState
from quad_description.rotations import from_rpy, Quaternion, Vector

from ..exceptions import SetupError
from .robot import Robot

PERIOD = 0.02  # [s]
MAX_DELAY = 1.0  # [s]


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
        *,
        delay: float = 0.0,
        bias: ImuBias | None = None,
    ) -> None:
        """Observe a robot.

        Args:
            delay: From targets that are sent to servos that have them in [s].
            bias: Of the IMU; None for none.

        Raises:
            SetupError: The delay is no time, or longer than a second.
        """
        if not 0.0 <= delay <= MAX_DELAY:
            raise SetupError(f'delay {delay} s: give 0 to {MAX_DELAY:g}')
        self.robot, self.period = robot, period
        self.names = robot.joint_names
        self._delay, self._bias = delay, bias
        self._begin()

    def reset(self) -> RobotState:
        """Stand on the ground again."""
        self.robot.reset()
        self._begin()
        return self.observe()

    def step(self, targets: Sequence[float] | None) -> RobotState:
        """Send targets, and let a period pass.

        Raises:
            SimulationError: A target is not finite, or the physics blew up.
        """
        sent_at = self._steps * self.period
        self._steps += 1
        if targets is not None and not self._delay:
            self.robot.set_targets(targets)
        elif targets is not None:
            self._on_the_way.append((sent_at + self._delay, targets))
        passed = 0.0
        while self._on_the_way and self._on_the_way[0][0] < sent_at + self.period:
            due, late = self._on_the_way.popleft()
            until = max(due - sent_at, passed)
            self.robot.step(until - passed)
            self.robot.set_targets(late)
            passed = until
        self.robot.step(self.period - passed)
        return self.observe()

    def observe(self) -> RobotState:
        """Return the true state."""
        robot = self.robot
        pose = robot.base_pose
        positions, velocities = robot.joint_positions, robot.joint_velocities
        orientation, rates, bias = pose.orientation, robot.base_velocity.angular, self._bias
        if bias is not None:
            orientation = bias.orientation(*pose.roll_pitch_yaw)
            rates = bias.rates(rates)
        return RobotState(
            JointSample(tuple(positions.tolist()), tuple(velocities.tolist()), robot.time),
            ImuSample(orientation, rates, robot.imu.specific_force),
            position=pose.position,
            linear_velocity=robot.base_velocity.linear,
            foot_contacts=robot.foot_contacts,
            time=robot.time,
        )

    def close(self) -> None:
        """Do nothing: the robot is memory."""

    def _begin(self) -> None:
        self._steps = 0
        self._on_the_way: deque[tuple[float, Sequence[float]]] = deque()
