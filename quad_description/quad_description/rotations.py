# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Rotations as unit quaternions (x, y, z, w), from the body to the world.

Roll, pitch and yaw turn about fixed axes x, y, z, in this order (REP 103). Angles are in [rad].
Plain floats, no arrays: one rotation of one vector costs a tenth of what numpy takes.
"""

from __future__ import annotations

import math

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

IDENTITY: Quaternion = (0.0, 0.0, 0.0, 1.0)


def normalized(rotation: Quaternion) -> Quaternion:
    """Return the unit quaternion of the same direction.

    Raises:
        ZeroDivisionError: All four numbers are zero.
    """
    x, y, z, w = rotation
    length = math.sqrt(x * x + y * y + z * z + w * w)
    return x / length, y / length, z / length, w / length


def from_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation by roll, then pitch, then yaw."""
    sr, cr = math.sin(roll / 2), math.cos(roll / 2)
    sp, cp = math.sin(pitch / 2), math.cos(pitch / 2)
    sy, cy = math.sin(yaw / 2), math.cos(yaw / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def axes_from_roll_pitch_yaw(roll: float, pitch: float, yaw: float) -> tuple[Vector, ...]:
    """Return the body's axes in the world; quicker than :func:`rotate` for several vectors."""
    sr, cr = math.sin(roll), math.cos(roll)
    sp, cp = math.sin(pitch), math.cos(pitch)
    sy, cy = math.sin(yaw), math.cos(yaw)
    return (
        (cy * cp, sy * cp, -sp),
        (cy * sp * sr - sy * cr, sy * sp * sr + cy * cr, cp * sr),
        (cy * sp * cr + sy * sr, sy * sp * cr - cy * sr, cp * cr),
    )


def roll_pitch_yaw(rotation: Quaternion) -> Vector:
    """Return the angles of a rotation; the pitch is within a quarter turn."""
    x, y, z, w = rotation
    # rounding may lead just beyond the range of asin
    pitch = math.asin(min(max(2 * (w * y - z * x), -1.0), 1.0))
    return math.atan2(2 * (w * x + y * z), 1 - 2 * (x * x + y * y)), pitch, yaw_of(rotation)


def yaw_of(rotation: Quaternion) -> float:
    """Return the yaw of a rotation."""
    x, y, z, w = rotation
    return math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z))


def tilt_of(rotation: Quaternion) -> float:
    """Return the angle between the body's z axis and up."""
    x, y, _, _ = rotation
    return math.acos(min(max(1 - 2 * (x * x + y * y), -1.0), 1.0))


def down_in_body(rotation: Quaternion) -> Vector:
    """Return the unit vector of gravity in the body; (0, 0, -1) upright."""
    x, y, z, w = rotation
    return 2 * (w * y - x * z), -2 * (y * z + w * x), 2 * (x * x + y * y) - 1.0


def about(axis: Vector, angle: float) -> Quaternion:
    """Return the rotation by an angle about a unit vector."""
    sine = math.sin(angle / 2)
    return sine * axis[0], sine * axis[1], sine * axis[2], math.cos(angle / 2)


def about_z(angle: float) -> Quaternion:
    """Return the rotation by an angle about the vertical."""
    return 0.0, 0.0, math.sin(angle / 2), math.cos(angle / 2)


def conjugate(rotation: Quaternion) -> Quaternion:
    """Return the inverse of a rotation."""
    x, y, z, w = rotation
    return -x, -y, -z, w


def multiply(second: Quaternion, first: Quaternion) -> Quaternion:
    """Return the rotation that does ``first``, then ``second``."""
    ax, ay, az, aw = second
    bx, by, bz, bw = first
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """Return in the world a vector of the body."""
    x, y, z, w = rotation
    vx, vy, vz = vector
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def rotation_vector(rotation: Quaternion) -> Vector:
    """Return axis times angle, the shorter way round."""
    x, y, z, w = rotation
    if w < 0.0:
        x, y, z, w = -x, -y, -z, -w
    length = math.sqrt(x * x + y * y + z * z)
    # near zero, angle / sin(angle / 2) is 2
    factor = 2.0 * math.atan2(length, w) / length if length > 1e-12 else 2.0
    return x * factor, y * factor, z * factor
