# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""An axis: the motion that is demanded of a motor, and the motor that follows it."""

from __future__ import annotations

from .motor import MotorModel
from .profile import hold, Limits, Motion, plan_velocity, Point
from .servo import Servo, ServoModel, SETTLED
from .switches import Switches


class Axis:
    """Demand and motor of a drive, at one point in time.

    Attributes:
        time: Steady time of the state in [s].
        motion: The demand, now and in future.
        demand: Position, velocity and acceleration demanded now.
        speed: Highest speed of the motor in [inc/s].
        motor: What it makes of a torque.
        load: Torque that it takes to hold the axis, in [0.1 % of the rated torque].
        switches: Where its switches are.
        origin: Where the mechanical zero is in [inc]; homing moves it.
    """

    def __init__(self, model: ServoModel) -> None:
        self.time = 0.0
        self.speed = float('inf')
        self.motor = MotorModel()
        self.load = 0.0
        self.origin = 0.0
        self.switches = Switches()
        self.motion = hold(0.0, 0.0)
        self.demand = Point(0.0, 0.0, 0.0)
        self._servo = Servo(model)

    @property
    def position(self) -> float:
        """Actual position in [inc]."""
        return self._servo.position

    @property
    def velocity(self) -> float:
        """Actual velocity in [inc/s]."""
        return self._servo.velocity

    @property
    def following_error(self) -> float:
        """Demand minus actual position in [inc]."""
        return self.demand.position - self._servo.position

    @property
    def blocked(self) -> bool:
        """The motor pushes against a mechanical stop."""
        return self._servo.blocked

    @property
    def torque(self) -> float:
        """Torque that the demanded motion takes, in [0.1 % of the rated torque]."""
        if not self.powered:
            return 0.0
        acceleration = 0.0 if self.arrived else self.demand.acceleration
        return self.motor.torque(self.velocity, acceleration, self.load)

    def set_stops(self, low: float, high: float) -> None:
        """Put mechanical stops at positions in [inc], infinite for none."""
        self._servo.stops = (low, high)

    @property
    def powered(self) -> bool:
        """The motor has torque."""
        return self._servo.powered

    @property
    def speed_limited(self) -> bool:
        """The demand is faster than the motor can turn."""
        return self._servo.limited

    @property
    def arrived(self) -> bool:
        """The demand has come to the end of its motion, a constant velocity included."""
        return self.time >= self.motion.end

    @property
    def settled(self) -> bool:
        """Demand and motor stand still, and will not move by themselves."""
        if not self._servo.powered:
            return self._servo.velocity == 0.0
        at_rest = self.arrived and self.demand.velocity == 0.0
        return at_rest and (self.blocked or abs(self.following_error) < SETTLED)

    def power_on(self, deceleration: float) -> None:
        """Close the position loop where the motor is; one that still runs out is ramped down."""
        self.demand = self._servo.power_on()
        self.stop(deceleration)

    def power_off(self) -> None:
        """Open the position loop; the motor runs out against its brake."""
        self._servo.power_off()
        self._rest()

    def follow(self, motion: Motion) -> None:
        """Take another motion, which begins now where the demand is."""
        self.motion = motion
        self.demand = motion.at(self.time)

    def stop(self, deceleration: float) -> None:
        """Ramp down to a stop, from where the motor is rather than from a demand far ahead."""
        start = self.demand
        if self._servo.limited or self.arrived:  # a cyclic set-point has no speed
            start = Point(self._servo.setpoint, self._servo.velocity, 0.0)
        limits = Limits(self.speed, deceleration, deceleration)
        self.follow(plan_velocity(start, 0.0, limits, self.time))

    def shift(self, offset: float) -> None:
        """Move the zero of the position by an offset in [inc]; the motor does not turn."""
        self._servo.shift(offset)
        self.origin += offset
        segments = self.motion.segments
        self.motion = Motion([s._replace(position=s.position + offset) for s in segments])
        self.demand = self.demand._replace(position=self.demand.position + offset)

    def advance(self, now: float) -> None:
        """Go on to a time in [s]; earlier ones are ignored."""
        if now <= self.time:
            return
        if self._servo.powered:
            self._servo.follow(self.motion, self.time, now, self.speed)
            self.time = now
            self.demand = self.motion.at(now)
        else:
            self._servo.coast(now - self.time)
            self.time = now
            self._rest()

    def _rest(self) -> None:
        """Let the demand be where the motor is, so that nothing jumps when power comes."""
        self.demand = Point(self._servo.position, 0.0, 0.0)
        self.motion = hold(self._servo.position, self.time)
