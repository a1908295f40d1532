# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Velocities of the body: clamped to what the robot can do, and changed no faster than it can."""

from __future__ import annotations

from dataclasses import dataclass
import math
from typing import NamedTuple


class Velocity(NamedTuple):
    """A velocity of the body over ground, in the body's level frame."""

    x: float = 0.0  # forward in [m/s]
    y: float = 0.0  # to the left in [m/s]
    yaw: float = 0.0  # turning to the left in [rad/s]

    def __str__(self) -> str:
        """Return it for people."""
        return f'{self.x:.2f} {self.y:.2f} m/s {self.yaw:.2f} rad/s'

    @property
    def finite(self) -> bool:
        """Whether all parts are numbers."""
        return all(map(math.isfinite, self))

    @property
    def at_rest(self) -> bool:
        """Whether it is exactly zero."""
        return self.x == self.y == self.yaw == 0.0

    def scaled(self, factor: float) -> Velocity:
        """Return the same direction, faster or slower."""
        return Velocity(self.x * factor, self.y * factor, self.yaw * factor)


REST = Velocity()


@dataclass(frozen=True, slots=True)
class VelocityLimits:
    """What the robot can do."""

    x: float  # forward and backward in [m/s]
    y: float  # to a side in [m/s]
    yaw: float  # turning in [rad/s]
    acceleration: float = 1.0  # change of x and y together in [m/s^2]
    yaw_acceleration: float = 4.0  # change of the turning in [rad/s^2]
    dead_linear: float = 0.002  # slower than this is standing in [m/s]
    dead_yaw: float = 0.01  # slower than this is no turning in [rad/s]

    def clamp(self, velocity: Velocity) -> Velocity:
        """Return the velocity within the ellipse of x and y, with the same direction."""
        over = math.hypot(velocity.x / self.x, velocity.y / self.y)
        scale = 1.0 / over if over > 1.0 else 1.0
        yaw = min(max(velocity.yaw, -self.yaw), self.yaw)
        moves = math.hypot(velocity.x, velocity.y) >= self.dead_linear
        return Velocity(
            velocity.x * scale if moves else 0.0,
            velocity.y * scale if moves else 0.0,
            yaw if abs(yaw) >= self.dead_yaw else 0.0,
        )

    def bound(self, velocity: Velocity) -> Velocity:
        """Return a velocity that was clamped before, with its turning within the limits again."""
        yaw = min(max(velocity.yaw, -self.yaw), self.yaw)
        return Velocity(velocity.x, velocity.y, yaw)

    def approach(self, velocity: Velocity, target: Velocity, dt: float) -> Velocity:
        """Return the velocity after a step of ``dt`` [s] of acceleration towards a target."""
        change_x, change_y = target.x - velocity.x, target.y - velocity.y
        change, most = math.hypot(change_x, change_y), self.acceleration * dt
        yaw = approach(velocity.yaw, target.yaw, self.yaw_acceleration * dt)
        if change <= most:
            return Velocity(target.x, target.y, yaw)
        share = most / change
        return Velocity(velocity.x + share * change_x, velocity.y + share * change_y, yaw)


def approach(value: float, target: float, most: float) -> float:
    """Return a value that has moved towards a target by no more than a step."""
    return target if abs(target - value) <= most else value + math.copysign(most, target - value)
