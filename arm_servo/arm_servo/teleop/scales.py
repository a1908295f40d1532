# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a share of 1 means to the servo, and by how much a single step moves."""

from __future__ import annotations

from dataclasses import dataclass
import math

from .jog import Jog, JointJog

UNITLESS = 'unitless'
"""command_in_type of a servo that multiplies by its scales itself."""


@dataclass(frozen=True, slots=True)
class Scales:
    """Full speeds of the servo; the defaults are those of moveit_servo.

    Attributes:
        linear: Of the tool [m/s].
        rotational: Of the tool [rad/s].
        joint: Of a joint [rad/s].
        unitless: The servo multiplies by these itself; else it receives speeds.
    """

    linear: float = 0.4
    rotational: float = 0.8
    joint: float = 0.5
    unitless: bool = True

    def to_message(self, jog: Jog) -> Jog:
        """Return the numbers that the servo is sent for a motion.

        Args:
            jog: The motion, in shares.
        """
        if self.unitless:
            return jog
        if isinstance(jog, JointJog):
            return JointJog(jog.joint, jog.velocity * self.joint)
        return jog.scaled(self.linear, self.rotational)


@dataclass(frozen=True, slots=True)
class Steps:
    """How far a stroke moves in step mode.

    A step is a motion of a certain time, so it works with every servo; begin and end have the same
    ramps, so the way is speed times time.

    Attributes:
        linear: Of the tool [m].
        angular: Of the tool, and of a joint [rad].
        duration: Least time of a step [s].
    """

    linear: float = 1e-3
    angular: float = math.radians(1.0)
    duration: float = 0.2

    def pulse(self, jog: Jog, scales: Scales) -> tuple[Jog, float]:
        """Return the motion that makes a step, and how long it takes [s].

        Args:
            jog: The direction, with the greatest speed that is wished for.
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
            return JointJog(jog.joint, jog.velocity * slower), duration
        return jog.scaled(slower, slower), duration
