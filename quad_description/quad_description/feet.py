# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where the feet are, from the lengths of the legs in robot.yaml."""

from __future__ import annotations

from collections.abc import Mapping
import math

from .figures import robot_numbers
from .joints import LEGS

Vector = tuple[float, float, float]


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


def _turned(x: float, z: float, angle: float) -> tuple[float, float]:
    """Turn a point about the y axis."""
    cos, sin = math.cos(angle), math.sin(angle)
    return cos * x + sin * z, -sin * x + cos * z
