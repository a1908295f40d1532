# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jog commands of a person, as shares of full speed, and their conversion to servo commands."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import auto, Enum
import math

Vector = tuple[float, float, float]
"""Linear or angular components along x, y and z."""

UNITLESS = 'unitless'  # command_in_type of a servo that multiplies by its scales itself


ServoReport = tuple[int, str]
"""Status of a servo: code (0: no warning, negative: refused) and message."""


class Frame(Enum):
    """Frame along whose axes the tool is jogged."""

    BASE = 'base'
    TOOL = 'tool'


class ServoRequest(Enum):
    """Requests of a person other than motions."""

    TOGGLE_PAUSE = auto()
    """Pause or resume the servo."""

    STOP_ROBOT = auto()
    """Stop every motion of the robot."""


@dataclass(frozen=True, slots=True)
class CartesianJog:
    """Move the tool at shares of its full linear and rotational speed, -1 to 1."""

    linear: Vector = (0.0, 0.0, 0.0)
    angular: Vector = (0.0, 0.0, 0.0)
    frame: Frame = Frame.BASE

    def scaled(self, linear: float, angular: float) -> CartesianJog:
        """Return the motion with linear and angular speed multiplied by these factors."""
        return CartesianJog(_times(self.linear, linear), _times(self.angular, angular), self.frame)


@dataclass(frozen=True, slots=True)
class JointJog:
    """Move a joint, given by its index from 0, at a share of full joint speed, -1 to 1."""

    joint: int
    velocity: float = 0.0

    def scaled(self, factor: float) -> JointJog:
        """Return the motion with its speed multiplied by a factor."""
        return replace(self, velocity=self.velocity * factor)


Jog = CartesianJog | JointJog


def rest_of(jog: Jog | None) -> Jog:
    """Return the zero command, of the same type, that ends a motion."""
    match jog:
        case JointJog(joint):
            return JointJog(joint)
        case CartesianJog(frame=frame):
            return CartesianJog(frame=frame)
    return CartesianJog()


@dataclass(frozen=True, slots=True)
class Scales:
    """Full speeds of the servo [m/s], [rad/s]; the defaults are those of moveit_servo."""

    linear: float = 0.4
    rotational: float = 0.8
    joint: float = 0.5
    unitless: bool = True  # the servo multiplies by these itself; else it receives speeds

    def to_message(self, jog: Jog) -> Jog:
        """Convert a motion to the values to send to the servo."""
        if self.unitless:
            return jog
        if isinstance(jog, JointJog):
            return jog.scaled(self.joint)
        return jog.scaled(self.linear, self.rotational)


@dataclass(frozen=True, slots=True)
class Steps:
    """Distance that a key stroke moves in step mode.

    A step is a motion of fixed duration, so it works with every servo; start and end have the same
    ramps, so the distance is speed times time.
    """

    linear: float = 1e-3  # of the tool [m]
    angular: float = math.radians(1.0)  # of the tool, and of a joint [rad]
    duration: float = 0.2  # least time of a step [s]

    def pulse(self, jog: Jog, scales: Scales) -> tuple[Jog, float]:
        """Return the motion of one step, and its duration in [s].

        Args:
            jog: The direction, and the greatest speed allowed.
            scales: Full speeds of the servo.
        """
        if isinstance(jog, JointJog):
            speed, way = abs(jog.velocity) * scales.joint, self.angular
        elif any(jog.linear):
            speed, way = max(map(abs, jog.linear)) * scales.linear, self.linear
        else:
            speed, way = max(map(abs, jog.angular)) * scales.rotational, self.angular
        duration = max(self.duration, way / speed)
        slower = way / speed / duration
        if isinstance(jog, JointJog):
            return jog.scaled(slower), duration
        return jog.scaled(slower, slower), duration


def _times(vector: Vector, factor: float) -> Vector:
    x, y, z = vector
    return x * factor, y * factor, z * factor
