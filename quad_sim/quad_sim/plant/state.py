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
    """Where base_link is.

    Attributes:
        position: Of base_link in the world [m].
        orientation: Of base_link in the world, (x, y, z, w).
    """

    position: Vector
    orientation: Quaternion

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
    """How base_link moves.

    Attributes:
        linear: Velocity of base_link's origin, in base_link [m/s].
        angular: Angular velocity, in base_link [rad/s].
    """

    linear: Vector
    angular: Vector


@dataclass(frozen=True, slots=True)
class Imu:
    """What an ideal IMU in imu_link feels.

    Attributes:
        specific_force: [m/s2]; +g up at rest; behind the low-pass of the chip.
        angular_velocity: [rad/s].
        roll_pitch_yaw: Attitude in the world [rad], fixed axes x, y, z.
    """

    specific_force: Vector
    angular_velocity: Vector
    roll_pitch_yaw: Vector


@dataclass(frozen=True, slots=True, eq=False)
class Measurement:
    """What the board has measured, noise and encoder steps included.

    Attributes:
        time: Of the measurement, since the start [s].
        imu: What the IMU measures.
        positions: Of the joints [rad], of the gripper [m]; in the order of the URDF.
        velocities: [rad/s], [m/s].
        torques: [N m], [N].
        foot_forces: Normal force on each foot, in the order of the legs [N].
    """

    time: float
    imu: Imu
    positions: Array
    velocities: Array
    torques: Array
    foot_forces: Array
