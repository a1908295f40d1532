# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The direction of gravity in the body, twice: from the attitude, and from the accelerometer."""

from __future__ import annotations

import math

from .rotation import conjugate, Quaternion, rotate, Vector

STANDARD_GRAVITY = 9.80665  # [m/s²]
TOLERANCE = 2.0  # [m/s²] beyond which the body is accelerating


def gravity_from_attitude(attitude: Quaternion) -> Vector:
    """Return the unit vector that points down, in the body."""
    return rotate(conjugate(attitude), (0.0, 0.0, -1.0))


def gravity_from_acceleration(acceleration: Vector) -> Vector | None:
    """Return the unit vector that points down, in the body; None while it accelerates.

    An accelerometer at rest reads the opposite of gravity (REP 145).
    """
    length = math.hypot(*acceleration)
    if abs(length - STANDARD_GRAVITY) > TOLERANCE:
        return None
    x, y, z = acceleration
    return -x / length, -y / length, -z / length


def disagreement(attitude: Quaternion, acceleration: Vector | None) -> float | None:
    """Return the angle between both directions [rad]; None while the body accelerates.

    More than a few degrees at rest: the axes of the IMU are not those of the body.
    """
    felt = None if acceleration is None else gravity_from_acceleration(acceleration)
    if felt is None:
        return None
    cosine = sum(a * b for a, b in zip(gravity_from_attitude(attitude), felt, strict=True))
    return math.acos(min(max(cosine, -1.0), 1.0))
