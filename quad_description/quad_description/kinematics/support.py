# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which feet are in the air."""

from __future__ import annotations

from collections.abc import Sequence
import math

from ..rotations import Vector
from .leg import FEET

MAX_GAP = 0.005  # [m] above the plane of the other three, of a foot that stands


def raised_feet(feet: Sequence[Vector]) -> tuple[str, ...]:
    """Return the feet that are in the air while the other three stand, whatever their plane.

    With one foot or a diagonal pair lifted, the robot rocks: both feet of the diagonal are raised.

    Args:
        feet: Their centres in the body, in the order of FEET [m].
    """
    raised = []
    for index, link in enumerate(FEET):
        a, b, c = (foot for other, foot in enumerate(feet) if other != index)
        normal = _cross(_difference(b, a), _difference(c, a))
        length = math.copysign(math.hypot(*normal), normal[2])  # up, in the body
        way = _difference(feet[index], a)
        height = sum(n * w for n, w in zip(normal, way, strict=True))
        if length and height / length > MAX_GAP:
            raised.append(link)
    return tuple(raised)


def _difference(one: Vector, other: Vector) -> Vector:
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]


def _cross(one: Vector, other: Vector) -> Vector:
    return (
        one[1] * other[2] - one[2] * other[1],
        one[2] * other[0] - one[0] * other[2],
        one[0] * other[1] - one[1] * other[0],
    )
