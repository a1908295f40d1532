# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Transforms as plain values: translation and unit quaternion.

Conventions, here and in the whole package: translations are (x, y, z) in [m]; quaternions are
(x, y, z, w), as in geometry_msgs; a transform *a to b* maps coordinates in b to coordinates in a
(the pose of b in a), as in tf2, where a is ``header.frame_id`` and b ``child_frame_id``. Plain
floats, no arrays: one rotation of one vector costs a tenth of what numpy takes.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

Vector = tuple[float, float, float]
Quaternion = tuple[float, float, float, float]

NO_ROTATION: Quaternion = (0.0, 0.0, 0.0, 1.0)


@dataclass(frozen=True, slots=True)
class Transform:
    """The pose of a child frame in its parent frame."""

    translation: Vector = (0.0, 0.0, 0.0)  # origin of the child in [m], in the parent
    rotation: Quaternion = NO_ROTATION  # unit quaternion (x, y, z, w)


def from_rpy(roll: float, pitch: float, yaw: float) -> Quaternion:
    """Return the rotation by angles about fixed axes x, y, z in [rad], in this order (REP 103)."""
    sr, cr = math.sin(roll / 2), math.cos(roll / 2)
    sp, cp = math.sin(pitch / 2), math.cos(pitch / 2)
    sy, cy = math.sin(yaw / 2), math.cos(yaw / 2)
    return (
        sr * cp * cy - cr * sp * sy,
        cr * sp * cy + sr * cp * sy,
        cr * cp * sy - sr * sp * cy,
        cr * cp * cy + sr * sp * sy,
    )


def about(axis: Vector, angle: float) -> Quaternion:
    """Return the rotation by an angle in [rad] about a unit vector."""
    sine = math.sin(angle / 2)
    return sine * axis[0], sine * axis[1], sine * axis[2], math.cos(angle / 2)


def multiply(second: Quaternion, first: Quaternion) -> Quaternion:
    """Return the rotation that applies ``first``, then ``second``."""
    ax, ay, az, aw = second
    bx, by, bz, bw = first
    return (
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    )


def rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """Rotate a vector."""
    x, y, z, w = rotation
    vx, vy, vz = vector
    tx, ty, tz = 2 * (y * vz - z * vy), 2 * (z * vx - x * vz), 2 * (x * vy - y * vx)
    return (
        vx + w * tx + y * tz - z * ty,
        vy + w * ty + z * tx - x * tz,
        vz + w * tz + x * ty - y * tx,
    )


def compose(parent: Transform, child: Transform) -> Transform:
    """Return the transform a to c from a to b (``parent``) and b to c (``child``)."""
    x, y, z = rotate(parent.rotation, child.translation)
    a, b, c = parent.translation
    return Transform((a + x, b + y, c + z), multiply(parent.rotation, child.rotation))
