# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot in physics as a back end, in virtual time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import math

import numpy as np

from quad_description import Backend, ImuSample, JointSample, movable_joints, RobotState
from quad_description.rotations import from_rpy, Quaternion, Vector

from ..state import BasePose
from .robot import Robot

SATURATED = 0.98  # share of a limit from which on a servo is at it


@dataclass(frozen=True, slots=True)
class Metered:
    """What a robot did in some time."""

    time: float  # how long in [s]
    x: float  # way ahead, in the robot's own frame, in [m]
    y: float  # way to the left in [m]
    yaw: float  # turning in [rad]
    path: float  # length of the way over the ground in [m]
    tilt: float  # largest tilt in [rad]
    energy: float  # mechanical work of the servos in [J]: the sum of all joints' absolute power
    weight: float  # of the robot in [N]
    # share of the time that a servo is at its largest torque, mean of all
    torque_saturation: float
    speed_saturation: float  # share of the time that a joint is at its largest speed, mean of all


class Meter:
    """Adds up what a robot does between two calls of :meth:`sample`, 20 ms apart or less."""

    def __init__(self, robot: Robot, urdf: str) -> None:
        """Begin now."""
        limits = [joint.limits for joint in movable_joints(urdf)]
        self._efforts = np.array([each.effort for each in limits])
        self._speeds = np.array([each.velocity for each in limits])
        self._robot = robot
        self.begin()

    def begin(self) -> None:
        """Begin anew; also after a reset of the robot."""
        self._start = self._time = self._robot.time
        self._pose: BasePose = self._robot.base_pose
        self._way = np.zeros(3)
        self._path = self._tilt = self._energy = 0.0
        self._torque_time = self._speed_time = 0.0

    def sample(self) -> None:
        """Sample the robot."""
        robot, before = self._robot, self._pose
        passed, self._time = robot.time - self._time, robot.time
        self._pose = after = robot.base_pose
        dx, dy = (b - a for a, b in zip(before.position[:2], after.position[:2], strict=True))
        heading, turned = before.roll_pitch_yaw[2], after.roll_pitch_yaw[2]
        cos, sin = math.cos(heading), math.sin(heading)
        yaw = math.remainder(turned - heading, math.tau)
        self._way += (dx * cos + dy * sin, dy * cos - dx * sin, yaw)
        self._path += math.hypot(dx, dy)
        self._tilt = max(self._tilt, after.tilt)
        torques, speeds = np.abs(robot.joint_torques), np.abs(robot.joint_velocities)
        self._energy += passed * float(torques @ speeds)
        self._torque_time += passed * float(np.mean(torques >= SATURATED * self._efforts))
        self._speed_time += passed * float(np.mean(speeds >= SATURATED * self._speeds))

    def read(self) -> Metered:
        """Return what came together since :meth:`begin`."""
        time = self._time - self._start
        x, y, yaw = self._way.tolist()
        return Metered(
            time=time,
            x=x,
            y=y,
            yaw=yaw,
            path=self._path,
            tilt=self._tilt,
            energy=self._energy,
            weight=9.81 * self._robot.mass,
            torque_saturation=self._torque_time / time if time > 0.0 else 0.0,
            speed_saturation=self._speed_time / time if time > 0.0 else 0.0,
        )


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
    """Has a robot followed by ideal sensors: no noise, and its position is known."""

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
