# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Back end with the robot in physics, in virtual time."""

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
    """Statistics of a robot over a time span; spans can be added."""

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
        """Merge two time spans."""
        both = {
            each.name: (getattr(self, each.name), getattr(other, each.name))
            for each in fields(self)
        }
        sums = {name: sum(pair) for name, pair in both.items()}
        return Metered(**sums | {name: max(both[name]) for name in ('tilt', 'weight')})

    @property
    def torque_saturation(self) -> float:
        """Fraction of time with a servo at its torque limit, mean of all."""
        return self.torque_time / self.time if self.time else 0.0

    @property
    def speed_saturation(self) -> float:
        """Fraction of time with a joint at its speed limit, mean of all."""
        return self.speed_time / self.time if self.time else 0.0


class Meter:
    """Accumulates statistics between calls of :meth:`sample`, at most 20 ms apart."""

    def __init__(self, robot: Robot, urdf: str) -> None:
        """Start now."""
        limits = [joint.limits for joint in movable_joints(urdf)]
        self._efforts = np.array([each.effort for each in limits])
        self._speeds = np.array([each.velocity for each in limits])
        self._robot = robot
        self.begin()

    def begin(self) -> None:
        """Restart; also required after a reset of the robot."""
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
        """Return the statistics since :meth:`begin`."""
        return self._sum


PERIOD = 0.02  # [s]


@dataclass(frozen=True, slots=True)
class ImuBias:
    """Constant errors of an IMU."""

    gyro: Vector = (0.0, 0.0, 0.0)  # of each axis of the gyro in [rad/s]
    roll: float = 0.0  # of the measured attitude in [rad]
    pitch: float = 0.0  # of the measured attitude in [rad]

    def orientation(self, roll: float, pitch: float, yaw: float) -> Quaternion:
        """Return the measured attitude for a true one [rad]."""
        return from_rpy(roll + self.roll, pitch + self.pitch, yaw)

    def rates(self, angular_velocity: Vector) -> Vector:
        """Return the measured angular velocity for a true one [rad/s]."""
        x, y, z = (a + b for a, b in zip(angular_velocity, self.gyro, strict=True))
        return x, y, z


class PhysicsBackend(Backend):
    """Simulated robot with ideal sensors: no noise, known position."""

    def __init__(
        self,
        robot: Robot,
        period: float = PERIOD,
        watch: Callable[[], None] = lambda: None,
    ) -> None:
        """Use a robot; ``watch`` is called after each step."""
        self.robot, self.period, self._watch = robot, period, watch
        self.names = robot.joint_names

    def reset(self) -> RobotState:
        """Reset the robot to standing."""
        self.robot.reset()
        return self.observe()

    def step(self, targets: Sequence[float] | None) -> RobotState:
        """Send targets and advance by one period.

        Raises:
            SimulationError: A target is not finite, or the simulation became unstable.
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
        """Do nothing: the robot holds no resources."""
