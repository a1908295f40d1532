# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The ground that the robot stands on."""

from __future__ import annotations

from dataclasses import dataclass
import math

from quad_description.rotations import about, Quaternion, Vector

from ..exceptions import SetupError

MAX_SLOPE = math.radians(45.0)  # [rad] steeper than any foot holds
MAX_ROUGHNESS = 0.1  # [m] higher than the hips of the robot


@dataclass(frozen=True, slots=True)
class Terrain:
    """A plane, level or tilted, with bumps on it or without."""

    angle: float = 0.0  # how steep it is [rad]
    direction: float = 0.0  # where it rises to, from the world's x axis counter-clockwise [rad]
    friction: float = 0.8  # coefficient of friction under the feet
    # Height of the highest bumps above the plane [m]; 0 for none. There are none where the robot
    # is put down, and only its feet touch them.
    roughness: float = 0.0
    seed: int = 0  # of the bumps

    def __post_init__(self) -> None:
        """Refuse ground that nothing stands on."""
        if not abs(self.angle) <= MAX_SLOPE:
            raise SetupError(
                f'slope of {self.angle} rad: give -{MAX_SLOPE:.2f} to {MAX_SLOPE:.2f}'
            )
        if not math.isfinite(self.direction):
            raise SetupError(f'slope direction {self.direction} is not an angle')
        if not 0.0 < self.friction < 10.0:
            raise SetupError(f'friction {self.friction}: give more than 0 and less than 10')
        if not 0.0 <= self.roughness <= MAX_ROUGHNESS:
            raise SetupError(f'roughness of {self.roughness} m: give 0 to {MAX_ROUGHNESS:g}')

    @classmethod
    def slope(cls, angle: float, direction: float = 0.0) -> Terrain:
        """Return ground that rises with an angle [rad] in a direction [rad]."""
        return cls(angle, direction)

    @property
    def normal(self) -> Vector:
        """Unit vector out of the ground, in the world."""
        return (
            -math.sin(self.angle) * math.cos(self.direction),
            -math.sin(self.angle) * math.sin(self.direction),
            math.cos(self.angle),
        )

    @property
    def orientation(self) -> Quaternion:
        """Rotation of a robot that stands on it and faces along the world's x axis.

        It turns by the slope about the horizontal axis across the direction of the slope.
        """
        across = math.sin(self.direction), -math.cos(self.direction), 0.0
        return about(across, self.angle)


FLAT = Terrain()
"""Level ground."""
