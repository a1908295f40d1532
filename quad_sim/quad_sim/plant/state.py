# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The state of a simulated robot as values; frames as in REP 103, quaternions (x, y, z, w)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quad_description.rotations import Quaternion, roll_pitch_yaw, tilt_of, Vector

Array = NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class BasePose:
    """Where base_link is."""

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
    """How base_link moves."""

    linear: Vector  # velocity of base_link's origin, in base_link [m/s]
    angular: Vector  # angular velocity, in base_link [rad/s]


@dataclass(frozen=True, slots=True)
class Imu:
    """What an ideal IMU in imu_link feels."""

    specific_force: Vector  # [m/s2]; +g up at rest; behind the low-pass of the chip
    angular_velocity: Vector  # [rad/s]
    roll_pitch_yaw: Vector  # attitude in the world [rad], fixed axes x, y, z


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """What the board has measured, noise and encoder steps included."""

    time: float  # of the measurement, since the start [s]
    imu: Imu  # what the IMU measures
    positions: Array  # of the joints [rad], of the gripper [m]; in the order of the URDF
    velocities: Array  # [rad/s], [m/s]
    torques: Array  # [N m], [N]
    foot_forces: Array  # normal force on each foot, in the order of the legs [N]
