# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Rotations as unit quaternions (x, y, z, w), from the body to the world.

Roll, pitch and yaw turn about fixed axes x, y, z, in this order (REP 103). Angles are in [rad].
Rotations that arms need as well are in urdf_reader.
"""

from __future__ import annotations

import math

from urdf_reader import about, from_rpy, multiply, Quaternion, rotate, Vector
from urdf_reader import NO_ROTATION as IDENTITY

__all__ = [
    'IDENTITY',
    'Quaternion',
    'Vector',
    'about',
    'about_z',
    'angle_between',
    'axes_from_rpy',
    'conjugate',
    'down_in_body',
    'from_rpy',
    'multiply',
    'normalized',
    'roll_pitch_yaw',
    'rotate',
    'rotation_vector',
    'tilt_of',
    'yaw_of',
]


def normalized(rotation: Quaternion) -> Quaternion:
    """Normalize a quaternion.

    Raises:
        ZeroDivisionError: All four numbers are zero.
    """
    x, y, z, w = rotation
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return x / length, y / length, z / length, w / length


def axes_from_rpy(roll: float, pitch: float, yaw: float) -> tuple[Vector, ...]:
    """Return the body's axes in the world; faster than :func:`rotate` for several vectors."""
    sr, cr = math.sin(roll), math.cos(roll)
    sp, cp = math.sin(pitch), math.cos(pitch)
    sy, cy = math.sin(yaw), math.cos(yaw)
    return (
        (cy * cp, sy * cp, -sp),
        (cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr),
        (cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr),
    )


def roll_pitch_yaw(rotation: Quaternion) -> Vector:
    """Return roll, pitch and yaw of a rotation; the pitch is within -pi/2 to pi/2."""
    x, y, z, w = rotation
    # rounding may lead just beyond the range of asin
    pitch = math.asin(min(max(2 * (w * y - z * x), -1.0), 1.0))
    return math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), pitch, yaw_of(rotation)


def yaw_of(rotation: Quaternion) -> float:
    """Return the yaw of a rotation."""
    x, y, z, w = rotation
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def tilt_of(rotation: Quaternion) -> float:
    """Return the angle between the body's z axis and the vertical."""
    x, y, _, _ = rotation
    return math.acos(min(max(1 - 2 * (x * x + y * y), -1.0), 1.0))


def down_in_body(rotation: Quaternion) -> Vector:
    """Return the unit vector of gravity in the body; (0, 0, -1) when upright."""
    x, y, z, w = rotation
    return 2 * (w * y - x * z), -2 * (y * z + w * x), 2 * (x * x + y * y) - 1.0


def about_z(angle: float) -> Quaternion:
    """Return the rotation by an angle about the z axis."""
    return 0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2)


def conjugate(rotation: Quaternion) -> Quaternion:
    """Return the inverse of a rotation."""
    x, y, z, w = rotation
    return -x, -y, -z, w


def rotation_vector(rotation: Quaternion) -> Vector:
    """Return the rotation vector (axis times angle) of the shorter rotation."""
    x, y, z, w = rotation
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    length = math.sqrt(x * x + y * y + z * z)
    # near zero, angle / sin(angle / 2) is 2
    factor = 2.0 * math.atan2(length, w) / length if length > 1e-12 else 2.0
    return x * factor, y * factor, z * factor


def angle_between(one: Vector, other: Vector) -> float:
    """Return the angle between two non-zero vectors."""
    cosine = sum(a * b for a, b in zip(one, other, strict=True))
    return math.acos(min(max(cosine / (math.hypot(*one) * math.hypot(*other)), -1.0), 1.0))
