# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The direction of gravity in the body, twice: from the attitude, and from the accelerometer."""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
import math

from quad_description.rotations import down_in_body, Quaternion, Vector

STANDARD_GRAVITY = 9.80665  # [m/s²]
TOLERANCE = 2.0  # [m/s²] beyond which the body is accelerating
REPORTS = 50  # that are looked at together: a second, in which the pushes of a gait cancel out


def gravity_from_acceleration(acceleration: Vector) -> Vector | None:
    """Return the unit vector that points down, in the body; None while it accelerates.

    An accelerometer at rest reads the opposite of gravity (REP 145).
    """
    length = math.hypot(*acceleration)
    if abs(length - STANDARD_GRAVITY) > TOLERANCE:
        return None
    x, y, z = acceleration
    return -x / length, -y / length, -z / length


class GravityCheck:
    """Compares both directions over some time: each step of a gait accelerates the body.

    More than a few degrees: the axes of the IMU are not those of the body.
    """

    def __init__(self) -> None:
        self._reports: deque[tuple[Quaternion, Vector]] = deque(maxlen=REPORTS)

    def take(self, attitude: Quaternion, acceleration: Vector | None) -> None:
        """Take a report.

        Args:
            acceleration: Specific force in the body [m/s²]; None when it is not measured.
        """
        if acceleration is not None:
            self._reports.append((attitude, acceleration))

    @property
    def error(self) -> float | None:
        """Angle between the means [rad]; None in the first second, and while it accelerates."""
        reports = list(self._reports)  # another thread may take the next one
        if len(reports) < REPORTS:
            return None
        down = _mean([down_in_body(attitude) for attitude, _ in reports])
        felt = gravity_from_acceleration(_mean([felt for _, felt in reports]))
        length = math.hypot(*down)
        if felt is None or length == 0.0:
            return None
        cosine = sum(a * b for a, b in zip(down, felt, strict=True)) / length
        return math.acos(min(max(cosine, -1.0), 1.0))


def _mean(vectors: Sequence[Vector]) -> Vector:
    x, y, z = (sum(values) / len(vectors) for values in zip(*vectors, strict=True))
    return x, y, z
