# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot that every environment has: another one in each episode, moved and sensed in steps."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

from gymnasium import spaces
import numpy as np
from numpy.typing import ArrayLike, NDArray

from quad_description import (
    ImuSample,
    JointSample,
    movable_joints,
    Pose,
    pose_positions,
    robot_urdf,
    RobotState,
)
from quad_description.rotations import down_in_body

from ..exceptions import SetupError, TargetError
from ..physics import ImuBias, Robot
from ..plant.servo import ServoModel, ServoParameters
from .randomization import Randomization
from .rewards import Motion

Floats = NDArray[np.float32]


class Observation(Enum):
    """Parts of an observation in their order: what it is, and how many numbers (0: a joint)."""

    ANGULAR_VELOCITY = ('of base_link in its own frame in [rad/s]', 3)
    DOWN = ('direction of gravity in base_link', 3)
    COMMAND = ('velocity ahead and to the left in [m/s], turning in [rad/s]', 3)
    POSITIONS = ('of the joints, from those of a robot that stands, in [rad]', 0)
    VELOCITIES = ('of the joints in [rad/s]', 0)
    ACTION = ('of the step before in [rad]', 0)

    def width(self, joints: int) -> int:
        """Return how many numbers it has."""
        return self.value[1] or joints


def row_of(seen: Mapping[Observation, ArrayLike]) -> Floats:
    """Return all parts of what is seen, one after the other."""
    return np.concatenate([np.asarray(seen[part], np.float32) for part in Observation])


PERIOD = 0.02  # [s]


class RandomizedRobot:
    """A robot in physics that differs in each episode, by ranges that are data.

    Actions are how far the targets of the joints are from a robot that stands in [rad].
    """

    def __init__(
        self,
        preset: str,
        servo: ServoModel | ServoParameters,
        randomization: Randomization,
        period: float,
    ) -> None:
        """Put the robot on the ground.

        Raises:
            SetupError: A target may come later than its step ends.
            DescriptionError: There is no such preset.
        """
        urdf = robot_urdf(preset)
        self.robot = Robot(urdf, servo, noise=randomization.noise)  # the robot in physics
        self.period = period  # time of a step in [s]
        self.vary(randomization)
        limits = [joint.limits for joint in movable_joints(urdf)]
        stand = pose_positions(Pose.STAND)
        # joint positions of a robot that stands in [rad]
        self.stand: Floats = np.array([stand[name] for name in self.robot.joint_names], np.float32)
        # actions that lead to the lower limits of the joints in [rad]
        self.lowest: Floats = np.array([each.lower for each in limits], np.float32) - self.stand
        # actions that lead to their upper limits in [rad]
        self.highest: Floats = np.array([each.upper for each in limits], np.float32) - self.stand
        self.action_space = spaces.Box(self.lowest, self.highest)  # all between them
        # the one of the step before; what the set-points are at the start of an episode
        self.action: Floats = np.zeros_like(self.stand)
        self.state = RobotState()  # what the sensors measured last

    def vary(self, randomization: Randomization) -> None:
        """Let other things differ from the next episode on; noise stays as it was made.

        Raises:
            SetupError: A target may come later than its step ends.
        """
        if randomization.delay[1] >= self.period:
            raise SetupError(
                f'delay {randomization.delay} s: give less than a period, {self.period} s'
            )
        self._randomization = randomization

    def begin(self, random: np.random.Generator) -> None:
        """Stand on the ground as another robot of the ranges."""
        ranges = self._randomization
        seed = int(random.integers(2**31))
        self.robot.reset(seed=seed, variation=ranges.variation(random))
        self._delay = float(random.uniform(*ranges.delay))
        x, y, z = random.uniform(*ranges.gyro_bias, 3).tolist()
        self._bias = ImuBias((x, y, z), *random.uniform(*ranges.level_bias, 2).tolist())
        self.action = self.robot.joint_targets.astype(np.float32) - self.stand
        self.state = self._sense()

    def step(self, action: Floats, random: np.random.Generator) -> Motion:
        """Send joint targets, let a period pass, and sense.

        Args:
            action: What leads beyond a limit is taken to the limit.

        Returns:
            What the step brought about.

        Raises:
            TargetError: A number is not finite, or there are too many or few.
            SimulationError: The physics blew up.
        """
        wanted = np.asarray(action, np.float32)
        if wanted.shape != self.stand.shape or not np.isfinite(wanted).all():
            raise TargetError(
                f'action {wanted}: give a finite number for each of {len(self.stand)} joints'
            )
        wanted = np.clip(wanted, self.lowest, self.highest)
        robot, interval = self.robot, self._randomization.kick_interval
        if interval and random.random() < self.period / interval:
            robot.kick((*random.uniform(*self._randomization.kick, 2).tolist(), 0.0))
        if self._delay:
            robot.step(self._delay)
        robot.set_targets((self.stand + wanted).astype(np.float64))
        robot.step(self.period - self._delay)
        motion = self._motion(wanted)
        self.action = wanted
        self.state = self._sense()
        return motion

    @property
    def seen(self) -> Mapping[Observation, ArrayLike]:
        """What a policy may see of it now."""
        joints, imu = self.state.joints, self.state.imu
        if (
            joints is None
            or imu is None
            or joints.velocities is None
            or imu.angular_velocity is None
        ):
            raise SetupError('a robot in physics measures joints and attitude')
        return {
            Observation.ANGULAR_VELOCITY: imu.angular_velocity,
            Observation.DOWN: imu.down,
            Observation.POSITIONS: np.asarray(joints.positions) - self.stand,
            Observation.VELOCITIES: joints.velocities,
            Observation.ACTION: self.action,
        }

    def _sense(self) -> RobotState:
        measured = self.robot.measure()
        imu = measured.imu
        orientation = self._bias.orientation(*imu.roll_pitch_yaw)
        rates = self._bias.rates(imu.angular_velocity)
        return RobotState(
            JointSample(
                tuple(measured.positions.tolist()),
                tuple(measured.velocities.tolist()),
                self.robot.time,
            ),
            ImuSample(orientation, rates, imu.specific_force),
            time=self.robot.time,
        )

    def _motion(self, action: Floats) -> Motion:
        robot = self.robot
        pose = robot.base_pose
        return Motion(
            velocity=robot.base_velocity,
            tilt=pose.tilt,
            down=down_in_body(pose.orientation),
            torques=robot.joint_torques,
            velocities=robot.joint_velocities,
            target_speed=(action.astype(np.float64) - self.action) / self.period,
        )
