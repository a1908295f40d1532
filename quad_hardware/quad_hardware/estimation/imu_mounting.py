# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How the IMU sits on the body, and with which signs it reports.

With a wrong sign, a controller that levels the body tilts it further and further. In the
vendor's own simulation the IMU is turned by 180 degrees about the vertical.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from quad_description.rotations import (
    conjugate,
    from_rpy,
    IDENTITY,
    multiply,
    Quaternion,
    rotate,
    Vector,
)

UNCHECKED_DEVIATION = math.pi / 2  # [rad] of an attitude whose signs were not checked
POSITIVE: Vector = (1.0, 1.0, 1.0)


@dataclass(frozen=True, slots=True)
class ImuMounting:
    """From what the IMU reports to base_link."""

    rotation: Quaternion = IDENTITY  # of the IMU's axes in base_link, (x, y, z, w)
    # of roll, pitch and yaw as they are reported, against REP 103
    attitude_signs: Vector = POSITIVE
    # of the specific force along x, y and z; +9.8 upwards at rest
    acceleration_signs: Vector = POSITIVE
    rate_signs: Vector = POSITIVE  # of the angular velocity about x, y and z
    checked: bool = False  # it was compared with gravity on this robot
    # the signs of the gyro were compared with turning it by hand
    rates_checked: bool = False

    def attitude(self, reported: Vector) -> Quaternion:
        """Return the attitude of base_link for reported roll, pitch and yaw [deg]."""
        roll, pitch, yaw = map(math.radians, _signed(self.attitude_signs, reported))
        return multiply(from_rpy(roll, pitch, yaw), conjugate(self.rotation))

    def acceleration(self, reported: Vector) -> Vector:
        """Return a specific force in base_link [m/s²]."""
        return rotate(self.rotation, _signed(self.acceleration_signs, reported))

    def rate(self, reported: Vector) -> Vector:
        """Return an angular velocity in base_link [rad/s] for a reported one [deg/s]."""
        x, y, z = map(math.radians, _signed(self.rate_signs, reported))
        return rotate(self.rotation, (x, y, z))


def _signed(signs: Vector, values: Vector) -> Vector:
    x, y, z = (sign * value for sign, value in zip(signs, values, strict=True))
    return x, y, z
