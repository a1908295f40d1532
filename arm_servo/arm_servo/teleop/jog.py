# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a person wants to be moved, in shares of full speed."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

Vector = tuple[float, float, float]
"""Along or about x, y and z."""


class Frame(Enum):
    """Along whose axes the tool is jogged."""

    BASE = 'base'
    TOOL = 'tool'


@dataclass(frozen=True, slots=True)
class CartesianJog:
    """Move the tool.

    Attributes:
        linear: Shares of the full linear speed, -1 to 1.
        angular: Shares of the full rotational speed.
        frame: Along whose axes.
    """

    linear: Vector = (0.0, 0.0, 0.0)
    angular: Vector = (0.0, 0.0, 0.0)
    frame: Frame = Frame.BASE

    def scaled(self, linear: float, angular: float) -> CartesianJog:
        """Return the same motion, slower or faster.

        Args:
            linear: Factor of the linear shares.
            angular: Factor of the others.
        """
        return CartesianJog(_times(self.linear, linear), _times(self.angular, angular), self.frame)


@dataclass(frozen=True, slots=True)
class JointJog:
    """Move one joint.

    Attributes:
        joint: Its place, 0 for the first.
        velocity: Share of the full joint speed, -1 to 1.
    """

    joint: int
    velocity: float = 0.0


Jog = CartesianJog | JointJog


def rest_of(jog: Jog | None) -> Jog:
    """Return the command that ends a motion, in the kind of the motion.

    Args:
        jog: The motion; None for none.
    """
    match jog:
        case JointJog(joint):
            return JointJog(joint)
        case CartesianJog(frame=frame):
            return CartesianJog(frame=frame)
    return CartesianJog()


def _times(vector: Vector, factor: float) -> Vector:
    x, y, z = vector
    return x * factor, y * factor, z * factor
