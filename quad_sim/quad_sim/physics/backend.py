# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot in physics as a back end, in virtual time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
import math

import numpy as np

from quad_description import Backend, ImuSample, JointSample, movable_joints, RobotState
from quad_description.rotations import from_rpy, Quaternion, Vector

from .robot import Robot

SATURATED = 0.98  # share of a limit from which on a servo is at it


@dataclass(frozen=True, slots=True)
class Metered:
    """What a robot did in some time; one time and another one make a sum."""

    time: float = 0.0  # how long in [s]
    x: float = 0.0  # way ahead, in the robot's own frame, in [m]
    y: float = 0.0  # way to the left in [m]
    yaw: float = 0.0  # turning in [rad]
    path: float = 0.0  # length of the way over the ground in [m]
    tilt: float = 0.0  # largest tilt in [rad]
    energy: float = 0.0  # mechanical work of the servos: sum of all joints' absolute power, in [J]
    weight: float = 0.0  # of the robot in [N]
    torque_time: float = 0.0  # with a servo at its largest torque, mean of all, in [s]
    speed_time: float = 0.0  # with a joint at its largest speed, mean of all, in [s]

    def __add__(self, other: Metered) -> Metered:
        """Return both together."""
        both = {
            each.name: (getattr(self, each.name), getattr(other, each.name))
            for each in fields(self)
        }
        sums = {name: sum(pair) for name, pair in both.items()}
        return Metered(**sums | {name: max(both[name]) for name in ('tilt', 'weight')})

    @property
    def torque_saturation(self) -> float:
        """Share of the time that a servo is at its largest torque, mean of all."""
        return self.torque_time / self.time if self.time else 0.0

    @property
    def speed_saturation(self) -> float:
        """Share of the time that a joint is at its largest speed, mean of all."""
        return self.speed_time / self.time if self.time else 0.0


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
        self._time, self._pose = self._robot.time, self._robot.base_pose
        self._sum = Metered(weight=9.81 * self._robot.mass)

    def sample(self) -> None:
        """Sample the robot."""
        robot, before = self._robot, self._pose
        passed, self._time = robot.time - self._time, robot.time
        self._pose = after = robot.base_pose
        dx, dy = (b - a for a, b in zip(before.position[:2], after.position[:2], strict=True))
        heading, turned = before.roll_pitch_yaw[2], after.roll_pitch_yaw[2]
        cos, sin = math.cos(heading), math.sin(heading)
        torques, speeds = np.abs(robot.joint_torques), np.abs(robot.joint_velocities)
        self._sum += Metered(
            time=passed,
            x=dx * cos + dy * sin,
            y=dy * cos - dx * sin,
            yaw=math.remainder(turned - heading, math.tau),
            path=math.hypot(dx, dy),
            tilt=after.tilt,
            energy=passed * float(torques @ speeds),
            torque_time=passed * float(np.mean(torques >= SATURATED * self._efforts)),
            speed_time=passed * float(np.mean(speeds >= SATURATED * self._speeds)),
        )

    def read(self) -> Metered:
        """Return what came together since :meth:`begin`."""
        return self._sum


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
        watch: Callable[[], None] = lambda: None,
    ) -> None:
        """Observe a robot; ``watch`` is called after each step."""
        self.robot, self.period, self._watch = robot, period, watch
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
        self._watch()
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
