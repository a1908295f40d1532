# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Transforms as plain values: translation and unit quaternion.

Conventions, here and in the whole package: translations are (x, y, z) in [m]; quaternions are
(x, y, z, w), as in geometry_msgs; a transform *a to b* maps coordinates in b to coordinates in a
(the pose of b in a), as in tf2, where a is ``header.frame_id`` and b ``child_frame_id``.
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
    """Make a quaternion of fixed-axis angles, as URDF's ``rpy`` means them: Rz * Ry * Rx.

    Args:
        pitch: About y in [rad].
    """
    about_x = about((1.0, 0.0, 0.0), roll)
    about_y = about((0.0, 1.0, 0.0), pitch)
    about_z = about((0.0, 0.0, 1.0), yaw)
    return multiply(about_z, multiply(about_y, about_x))


def about(axis: Vector, angle: float) -> Quaternion:
    """Make a quaternion of a rotation about an axis.

    Args:
        axis: Unit vector.
    """
    sine = math.sin(0.5 * angle)
    return (axis[0] * sine, axis[1] * sine, axis[2] * sine, math.cos(0.5 * angle))


def multiply(left: Quaternion, right: Quaternion) -> Quaternion:
    """Multiply quaternions: first the rotation ``right``, then ``left``."""
    lx, ly, lz, lw = left
    rx, ry, rz, rw = right
    return (
        lw * rx + lx * rw + ly * rz - lz * ry,
        lw * ry - lx * rz + ly * rw + lz * rx,
        lw * rz + lx * ry - ly * rx + lz * rw,
        lw * rw - lx * rx - ly * ry - lz * rz,
    )


def rotate(rotation: Quaternion, vector: Vector) -> Vector:
    """Rotate a vector."""
    x, y, z, w = rotation
    inverse = (-x, -y, -z, w)
    turned = multiply(multiply(rotation, (*vector, 0.0)), inverse)
    return turned[:3]
