# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""Torque and motion of a motor with inertia, friction and a load.

.. math:: \dot v = g\,(T - L - T_c \operatorname{sign} v - b v)

with the torque :math:`T` and the load :math:`L` in [0.1 % of the rated torque], the dry friction
:math:`T_c` in the same unit and the viscous friction :math:`b`. A positive load pulls towards
negative positions and needs a positive torque to be held, as gravity does.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from .profile import advanced, Motion, Point, Segment


@dataclass(frozen=True, slots=True)
class MotorModel:
    """What a motor makes of a torque.

    Attributes:
        gain: Acceleration per torque in [inc/s^2 per 0.1 % of the rated torque].
        friction: Dry friction in [0.1 % of the rated torque].
        viscous: Friction that grows with the speed in [0.1 % of the rated torque per inc/s].
        interval: How long a torque is taken as constant in [s].
    """

    gain: float = 20.0
    friction: float = 20.0
    viscous: float = 0.01
    interval: float = 0.002

    def torque(self, velocity: float, acceleration: float, load: float) -> float:
        """Return the torque that a motion needs."""
        dry = math.copysign(self.friction, velocity) if velocity else 0.0
        return acceleration / self.gain + dry + self.viscous * velocity + load

    def rests(self, torque: float, load: float) -> bool:
        """Return whether friction holds a standing motor."""
        return abs(torque - load) <= self.friction

    def acceleration(self, torque: float, velocity: float, load: float) -> float:
        """Return what a torque causes, in [inc/s^2]."""
        drive = torque - load
        if velocity == 0.0 and self.rests(torque, load):
            return 0.0
        dry = math.copysign(self.friction, velocity or drive)
        return self.gain * (drive - dry - self.viscous * velocity)

    def step(self, start: Point, torque: float, load: float, speed: float, now: float) -> Motion:
        """Return the motion under a constant torque for an interval, then at its velocity.

        Args:
            start: Present position and velocity.
            torque: Of the motor.
            load: That it works against.
            speed: Highest speed in [inc/s], infinite for none.
            now: Start time in [s].
        """
        duration = self.interval
        position, velocity, _ = start
        rate = self.acceleration(torque, velocity, load)
        end = velocity + rate * duration
        if velocity * end < 0.0 and self.rests(torque, load):
            end = 0.0  # friction brings it to rest, and does not turn it back
        end = min(max(end, -speed), speed)
        rate = rate or (end - velocity) / duration
        braked = (end - velocity) / rate if rate else 0.0
        if not 0.0 < braked <= duration:  # it was faster than allowed: brake within the step
            braked, rate = duration, (end - velocity) / duration
        first = Segment(now, position, velocity, rate)
        reached = advanced(first, braked).position
        return Motion((first, Segment(now + braked, reached, end, 0.0)))
