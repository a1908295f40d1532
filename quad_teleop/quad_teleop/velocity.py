# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the robot has to do at one moment."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Velocity:
    """Velocity of the body, in base_link (REP 103).

    Attributes:
        x: Forward [m/s].
        y: To the left [m/s].
        yaw: Turning to the left [rad/s].
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0


ZERO = Velocity()
"""Stand still."""


@dataclass(frozen=True, slots=True)
class Direction:
    """Which way to go, as factors of the two speeds.

    Attributes:
        x: Forward, -1 to 1.
        y: To the left, -1 to 1.
        yaw: Turning to the left, -1 to 1.
    """

    x: float = 0.0
    y: float = 0.0
    yaw: float = 0.0

    def at(self, speed: float, turn: float) -> Velocity:
        """Return the velocity this way.

        Args:
            speed: Linear speed [m/s].
            turn: Angular speed [rad/s].
        """
        return Velocity(self.x * speed, self.y * speed, self.yaw * turn)


def rest_of(_: Velocity | None) -> Velocity:
    """Return the velocity that ends a motion."""
    return ZERO
