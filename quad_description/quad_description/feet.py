# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where the feet are, from the lengths of the legs in robot.yaml, and which are in the air."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math

from .figures import robot_numbers
from .joints import LEGS

Vector = tuple[float, float, float]

MAX_GAP = 0.005  # [m] above the plane of the other three, of a foot that stands


def foot_position(leg: str, positions: Mapping[str, float]) -> Vector:
    """Return the centre of a foot's pad in base_link.

    Args:
        leg: fl, fr, bl or br.
        positions: Of the leg's joints by name [rad]; zero for those left out.

    Returns:
        x, y, z [m].
    """
    numbers = robot_numbers()['legs']
    hip = numbers['hip_front' if leg[0] == 'f' else 'hip_rear']
    thigh, calf, foot = (numbers[name] for name in ('thigh', 'calf', 'foot'))
    side = 1.0 if leg[1] == 'l' else -1.0
    roll, pitch, knee = (
        positions.get(f'{leg}_{joint}_joint', 0.0) for joint in ('hip', 'thigh', 'calf')
    )
    # calf and thigh turn about y
    x, z = _turned(foot[0], foot[2], knee)
    x, z = _turned(calf[0] + x, calf[2] + z, pitch)
    x, y, z = thigh[0] + x, side * (thigh[1] + foot[1]), thigh[2] + z
    # the hip turns about x, the left one backward
    angle = -side * roll
    cos, sin = math.cos(angle), math.sin(angle)
    y, z = cos * y - sin * z, sin * y + cos * z
    return hip[0] + x, side * hip[1] + y, hip[2] + z


def standing_height(positions: Mapping[str, float]) -> float:
    """Return how high base_link is above ground that its lowest foot touches [m]."""
    radius: float = robot_numbers()['legs']['foot_radius']
    return radius - min(foot_position(leg, positions)[2] for leg in LEGS)


def raised_feet(feet: Sequence[Vector]) -> tuple[str, ...]:
    """Return the feet that are in the air while the other three stand, whatever their plane.

    With one foot or a diagonal pair lifted, the robot rocks: both feet of the diagonal are raised.

    Args:
        feet: Their centres in the body, in the order of LEGS [m].
    """
    raised = []
    for index, leg in enumerate(LEGS):
        a, b, c = (foot for other, foot in enumerate(feet) if other != index)
        normal = _cross(_difference(b, a), _difference(c, a))
        length = math.copysign(math.hypot(*normal), normal[2])  # up, in the body
        way = _difference(feet[index], a)
        height = sum(n * w for n, w in zip(normal, way, strict=True))
        if length and height / length > MAX_GAP:
            raised.append(f'{leg}_foot')
    return tuple(raised)


def _difference(one: Vector, other: Vector) -> Vector:
    return one[0] - other[0], one[1] - other[1], one[2] - other[2]


def _cross(one: Vector, other: Vector) -> Vector:
    return (
        one[1] * other[2] - one[2] * other[1],
        one[2] * other[0] - one[0] * other[2],
        one[0] * other[1] - one[1] * other[0],
    )


def _turned(x: float, z: float, angle: float) -> tuple[float, float]:
    """Turn a point about the y axis."""
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * x + sin * z, -sin * x + cos * z
