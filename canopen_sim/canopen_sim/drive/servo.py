# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""How the motor follows its demand: limited in speed, and a little late.

The demand :math:`p` passes a rate limiter, which never moves faster than the motor can, and the
motor position :math:`y` follows its output :math:`r` through a first-order lag:

.. math:: \tau \dot y = r - y.

On a segment where :math:`r(s) = r_0 + v s + \frac{1}{2} a s^2` this has the solution

.. math::
    y(s) = q(s) + (y_0 - q(0))\, e^{-s/\tau}, \qquad q(s) = r(s) - \tau r'(s) + \tau^2 a,

so the state at any time does not depend on how often it is evaluated. Without torque the motor
coasts against its brake: the velocity decays with another time constant.
Positions are in [inc], velocities in [inc/s], times in [s].
"""

from __future__ import annotations

from dataclasses import dataclass
import math

from .profile import advanced, Motion, Point, Segment

TOLERANCE = 1e-6  # [inc] a smaller gap between demand and limiter is rounding
SETTLED = 1e-4  # [inc] a smaller distance to the demand is none
SEGMENTS_MAX = 8  # a parabola is caught and lost less often than that


@dataclass(frozen=True, slots=True)
class ServoModel:
    """Time constants of a motor.

    Attributes:
        lag: Of the position loop in [s]; the following error is velocity times lag.
        coasting: Of the velocity in [s] when the power stage is off.
    """

    lag: float = 0.002
    coasting: float = 0.03


class Servo:
    """A motor with its position loop.

    Attributes:
        position: Where the motor is.
        setpoint: Output of the rate limiter.
        powered: The position loop is closed.
        limited: The motor is behind a demand that was faster than it can be.
        stops: Lowest and highest position that mechanical stops let it reach.
    """

    def __init__(self, model: ServoModel) -> None:
        self.position = 0.0
        self.setpoint = 0.0
        self.powered = False
        self.limited = False
        self.stops = (-math.inf, math.inf)
        self._model = model
        self._free_velocity = 0.0

    @property
    def velocity(self) -> float:
        """How fast the motor turns."""
        if not self.powered:
            return self._free_velocity
        if self.blocked:
            return 0.0
        return (self.setpoint - self.position) / self._model.lag

    @property
    def blocked(self) -> bool:
        """The position loop pushes the motor against a stop."""
        if not self.powered:
            return False
        low, high = self.stops
        gap = self.setpoint - self.position
        return (self.position >= high and gap > 0.0) or (self.position <= low and gap < 0.0)

    def power_on(self) -> Point:
        """Close the position loop and return where the demand has to begin."""
        self.setpoint = self.position + self._free_velocity * self._model.lag
        self.powered = True
        return Point(self.setpoint, self._free_velocity, 0.0)

    def power_off(self) -> None:
        """Open the position loop; the motor runs out."""
        self._free_velocity = self.velocity
        self.powered = self.limited = False

    def shift(self, offset: float) -> None:
        """Move the zero of the position, not the motor."""
        self.position += offset
        self.setpoint += offset
        self.stops = (self.stops[0] + offset, self.stops[1] + offset)

    def coast(self, duration: float) -> None:
        """Run out for a time."""
        if self._free_velocity == 0.0:
            return
        decay = math.exp(-duration / self._model.coasting)
        self.position += self._free_velocity * self._model.coasting * (1.0 - decay)
        self._free_velocity *= decay
        if abs(self._free_velocity) * self._model.coasting < SETTLED:
            self._free_velocity = 0.0
        if self._halt_at_stops():
            self._free_velocity = 0.0

    def follow(self, motion: Motion, begin: float, end: float, speed: float) -> None:
        """Follow a demand from one time to another.

        Args:
            motion: The demand.
            begin: Time of the present state.
            end: Time to go to.
            speed: Highest speed of the motor, infinite for none.
        """
        for start, duration in motion.pieces(begin, end):
            self._follow_piece(start, duration, speed)

    def _follow_piece(self, start: Point, duration: float, speed: float) -> None:
        position, velocity, acceleration = start
        last = velocity + acceleration * duration
        caught = abs(position - self.setpoint) <= TOLERANCE
        if caught and abs(velocity) <= speed and abs(last) <= speed:
            self.limited = False
            self._track(start, duration)
            return
        for _ in range(SEGMENTS_MAX):
            elapsed = self._segment(start, duration, speed)
            duration -= elapsed
            if duration <= 0.0:
                return
            start = advanced(Segment(0.0, *start), elapsed)

    def _segment(self, start: Point, duration: float, speed: float) -> float:
        """Follow until the limiter catches the demand or loses it; return the time taken."""
        position, velocity, acceleration = start
        gap = position - self.setpoint
        if abs(gap) <= TOLERANCE:
            gap = 0.0
            time = _time_within(velocity, acceleration, speed)
            if time > 0.0:
                time = min(time, duration)
                self.limited = False
                self._track(start, time)
                return time
        sign = math.copysign(1.0, gap or velocity or acceleration)
        closing = velocity - sign * speed
        time = _first_root(0.5 * acceleration, closing, gap)
        self.limited = time > duration
        time = min(time, duration)
        self._track(Point(self.setpoint, sign * speed, 0.0), time)
        if not self.limited:
            self.setpoint = advanced(Segment(0.0, *start), time).position
        return time

    def _track(self, start: Point, duration: float) -> None:
        """Let the limiter take a segment, and the motor follow it (see the module)."""
        lag = self._model.lag
        position, velocity, acceleration = start
        offset = self.position - (position - lag * velocity + lag * lag * acceleration)
        end = advanced(Segment(0.0, *start), duration)
        self.setpoint = end.position
        self.position = (
            end.position
            - lag * end.velocity
            + lag * lag * acceleration
            + offset * math.exp(-duration / lag)
        )
        self._halt_at_stops()

    def _halt_at_stops(self) -> bool:
        low, high = self.stops
        if low <= self.position <= high:
            return False
        self.position = min(max(self.position, low), high)
        return True


def _time_within(velocity: float, acceleration: float, speed: float) -> float:
    """Return how long a demand stays within the speed of the motor; 0 when it leaves now."""
    if abs(velocity) > speed:
        return 0.0
    if acceleration == 0.0:
        return math.inf
    return (math.copysign(speed, acceleration) - velocity) / acceleration


def _first_root(a: float, b: float, c: float) -> float:
    """Return the smallest positive root of a t^2 + b t + c, infinite when there is none."""
    if c == 0.0:
        root = -b / a if a else math.inf
        return root if root > 0.0 else math.inf
    if a == 0.0:
        root = -c / b if b else math.inf
        return root if root > 0.0 else math.inf
    discriminant = b * b - 4.0 * a * c
    if discriminant < 0.0:
        return math.inf
    # the form without cancellation
    half = -0.5 * (b + math.copysign(math.sqrt(discriminant), b))
    roots = [root for root in (half / a, c / half if half else math.inf) if root > 0.0]
    return min(roots, default=math.inf)
