# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""State of a simulated robot, sensor noise, and terrain.

Frames are as in REP 103, quaternions are (x, y, z, w).
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np
from numpy.typing import NDArray

from quad_description.rotations import about, Quaternion, roll_pitch_yaw, tilt_of, Vector

from .exceptions import SetupError

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BasePose:
    """Pose of base_link."""

    position: Vector  # of base_link in the world [m]
    orientation: Quaternion  # of base_link in the world, (x, y, z, w)

    @property
    def roll_pitch_yaw(self) -> Vector:
        """Attitude [rad], fixed axes x, y, z."""
        return roll_pitch_yaw(self.orientation)

    @property
    def tilt(self) -> float:
        """Angle between the body's z axis and the vertical [rad]."""
        return tilt_of(self.orientation)


@dataclass(frozen=True, slots=True)
class BaseVelocity:
    """Velocity of base_link."""

    linear: Vector  # velocity of base_link's origin, in base_link [m/s]
    angular: Vector  # angular velocity, in base_link [rad/s]


@dataclass(frozen=True, slots=True)
class Imu:
    """Values of an ideal IMU at imu_link."""

    specific_force: Vector  # [m/s2]; +g up at rest; behind the low-pass of the chip
    angular_velocity: Vector  # [rad/s]
    roll_pitch_yaw: Vector  # attitude in the world [rad], fixed axes x, y, z


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """Values measured by the board, including noise and encoder resolution."""

    imu: Imu  # what the IMU measures
    positions: Array  # of the joints [rad], of the gripper [m]; in the order of the URDF
    velocities: Array  # [rad/s], [m/s]
    torques: Array  # [N m], [N]


ENCODER_STEP = 2 * math.pi / 4096  # [rad] the servos' magnetic encoder has 12 bits


@dataclass(frozen=True, slots=True)
class Noise:
    """Standard deviations of the sensors."""

    attitude: float = 0.0  # of the fused roll, pitch and yaw [rad]
    angular_velocity: float = 0.0  # of the gyro [rad/s]
    specific_force: float = 0.0  # of the accelerometer [m/s2]
    position: float = 0.0  # of a joint [rad]
    velocity: float = 0.0  # of a joint's speed [rad/s]
    encoder_step: float = 0.0  # least difference of two positions [rad]; 0 for none


NONE = Noise()
"""Sensors without noise."""

BOARD = Noise(
    attitude=math.radians(0.1),
    angular_velocity=0.01,
    specific_force=0.05,
    position=math.radians(0.05),
    velocity=math.radians(2.0),
    encoder_step=ENCODER_STEP,
)
"""A board with a 9-axis IMU and 12-bit encoders; the figures are ours."""


def disturb(truth: Measurement, noise: Noise, random: np.random.Generator) -> Measurement:
    """Add sensor noise to a true state."""
    if noise == NONE:
        return truth
    count = len(truth.positions)
    # one draw for everything: the generator costs more than the numbers
    drawn = random.standard_normal(2 * count + 9)
    positions: Array = truth.positions + noise.position * drawn[:count]
    velocities: Array = truth.velocities + noise.velocity * drawn[count : 2 * count]
    if noise.encoder_step:
        positions = np.rint(positions / noise.encoder_step) * noise.encoder_step
    vectors = drawn[2 * count :].tolist()
    imu = Imu(
        _scatter(truth.imu.specific_force, noise.specific_force, vectors[:3]),
        _scatter(truth.imu.angular_velocity, noise.angular_velocity, vectors[3:6]),
        _scatter(truth.imu.roll_pitch_yaw, noise.attitude, vectors[6:]),
    )
    return Measurement(imu, positions, velocities, truth.torques)


def _scatter(vector: Vector, deviation: float, drawn: list[float]) -> Vector:
    (x, y, z), (dx, dy, dz) = vector, drawn
    return x + deviation * dx, y + deviation * dy, z + deviation * dz


MAX_SLOPE = math.radians(45.0)  # [rad] steeper than any foot holds
MAX_ROUGHNESS = 0.1  # [m] higher than the hips of the robot


@dataclass(frozen=True, slots=True)
class Terrain:
    """A plane, level or tilted, optionally with bumps."""

    angle: float = 0.0  # how steep it is [rad]
    direction: float = 0.0  # where it rises to, from the world's x axis counter-clockwise [rad]
    friction: float = 0.8  # coefficient of friction under the feet
    # Height of the highest bumps above the plane [m]; 0 for none. There are none where the robot
    # is put down, and only its feet touch them.
    roughness: float = 0.0
    seed: int = 0  # of the bumps

    def __post_init__(self) -> None:
        """Reject invalid ground."""
        if not abs(self.angle) <= MAX_SLOPE:
            raise SetupError(
                f'slope of {self.angle} rad: give -{MAX_SLOPE:.2f} to {MAX_SLOPE:.2f}'
            )
        if not math.isfinite(self.direction):
            raise SetupError(f'slope direction {self.direction} is not an angle')
        if not 0.0 < self.friction < 10.0:
            raise SetupError(f'friction {self.friction}: give more than 0 and less than 10')
        if not 0.0 <= self.roughness <= MAX_ROUGHNESS:
            raise SetupError(f'roughness of {self.roughness} m: give 0 to {MAX_ROUGHNESS:g}')

    @classmethod
    def slope(cls, angle: float, direction: float = 0.0) -> Terrain:
        """Create a slope that rises by an angle [rad] in a direction [rad]."""
        return cls(angle, direction)

    @property
    def normal(self) -> Vector:
        """Upward unit normal of the ground, in the world."""
        return (
            -math.sin(self.angle) * math.cos(self.direction),
            -math.sin(self.angle) * math.sin(self.direction),
            math.cos(self.angle),
        )

    @property
    def orientation(self) -> Quaternion:
        """Rotation of a robot that stands on the ground and faces along the world's x axis.

        It rotates by the slope angle about the horizontal axis perpendicular to the slope
        direction.
        """
        across = math.sin(self.direction), -math.cos(self.direction), 0.0
        return about(across, self.angle)


FLAT = Terrain()
"""Level ground."""
