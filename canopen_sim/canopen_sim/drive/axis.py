# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""An axis: the demanded motion, the motor that follows it, and its switches.

The demand consists of phases of constant acceleration. Each phase follows from the state at its
start and from the goal (a velocity, or a position to stop at), so the goal can change at any
time without a jump. A step of the axis ends at the end of a phase, and the solution within a
phase is exact: results do not depend on how often the axis is advanced.

The motor position :math:`y` follows the demand :math:`r` through a first-order lag,
:math:`\tau \dot y = r - y`. On a phase with velocity :math:`v` and acceleration :math:`a`

.. math::
    y(s) = q(s) + (y_0 - q(0))\, e^{-s/\tau}, \qquad q(s) = r(s) - \tau r'(s) + \tau^2 a.

A demand faster than the motor first passes a rate limiter, in steps of 1 ms. Without torque the
motor coasts against its brake: its velocity decays with another time constant.

Of a torque :math:`T` the motor makes :math:`\dot v = g\,(T - L - T_c \operatorname{sign} v - b v)`
with the load :math:`L`, dry friction :math:`T_c` and viscous friction :math:`b`. A positive load
pulls towards negative positions, as gravity does, and a positive torque holds it.

Positions are in [inc], velocities in [inc/s], accelerations in [inc/s^2], torques in [0.1 % of
the rated torque], times on the steady clock in [s].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import auto, Enum
import math
from typing import NamedTuple

from ..object_store import NEVER

LIMITER_STEP = 0.001  # [s] of the rate limiter
SETTLED = 1e-4  # [inc] a smaller distance is none
CRUISE_MIN = 1e-6  # [s] so that no phase is shorter than the resolution of a steady clock
ROUNDING = 1e-6  # [inc] a smaller gap between demand and limiter is rounding
TORQUE_STEP = 0.002  # [s] how long a torque is taken as constant

TORQUE_GAIN = 20.0  # [inc/s^2 per 0.1 % of the rated torque]
DRY_FRICTION = 20.0  # [0.1 % of the rated torque]
VISCOUS_FRICTION = 0.01  # [0.1 % of the rated torque per inc/s]


@dataclass(frozen=True, slots=True)
class ServoModel:
    """Time constants of a motor."""

    lag: float = 0.002  # of the position loop in [s]; the following error is velocity times lag
    coasting: float = 0.03  # of the velocity in [s] when the power stage is off


class Switch(Enum):
    """A switch that homing can look for."""

    NEGATIVE_LIMIT = auto()
    POSITIVE_LIMIT = auto()
    HOME = auto()


SWITCH_BITS: dict[Switch, int] = {
    Switch.NEGATIVE_LIMIT: 0x1,
    Switch.POSITIVE_LIMIT: 0x2,
    Switch.HOME: 0x4,
}
"""Bits of the digital inputs 0x60FD (CiA 402-2)."""

INTERLOCK_BIT = 0x8  # of 0x60FD: safe torque off


@dataclass(frozen=True, slots=True)
class Switches:
    """Positions of the switches of an axis in [inc], relative to its mechanical zero.

    The mechanical zero is the motor position at the first power-on; homing does not move it.
    The drive shows limit switches in 0x60FD, and stops at them only during homing.
    """

    # at and below it the negative limit switch is active; -inf for none
    negative_limit: float = -4000.0
    # at and above it the positive limit switch is active; inf for none
    positive_limit: float = 4000.0
    # the home switch is active from the first to the second; NaN for none
    home: tuple[float, float] = (500.0, 700.0)
    index: float = 100.0  # where one of the index pulses of the encoder is
    index_period: float = 1000.0  # between two of them; 0 for none

    def active(self, switch: Switch, position: float) -> bool:
        """Return whether a switch is active at a mechanical position."""
        match switch:
            case Switch.NEGATIVE_LIMIT:
                return position <= self.negative_limit
            case Switch.POSITIVE_LIMIT:
                return position >= self.positive_limit
        return self.home[0] <= position <= self.home[1]

    def limit_ahead(self, direction: int, position: float) -> bool:
        """Return whether the limit switch in a direction is active."""
        ahead = Switch.POSITIVE_LIMIT if direction > 0 else Switch.NEGATIVE_LIMIT
        return self.active(ahead, position)

    def inputs(self, position: float) -> int:
        """Return the bits of 0x60FD at a mechanical position."""
        return sum(bit for switch, bit in SWITCH_BITS.items() if self.active(switch, position))

    def edge(self, switch: Switch, side: int) -> float:
        """Return the position of a switch's edge; for the home switch, the edge on one side."""
        if switch is Switch.HOME:
            return self.home[side > 0]
        negative = switch is Switch.NEGATIVE_LIMIT
        return self.negative_limit if negative else self.positive_limit

    def next_index(self, position: float, direction: int) -> float:
        """Return the position of the next index pulse in a direction; infinite for none."""
        if self.index_period <= 0.0:
            return direction * math.inf
        turns = (position - self.index) / self.index_period
        whole = math.floor(turns) + 1 if direction > 0 else math.ceil(turns) - 1
        return self.index + whole * self.index_period


class Limits(NamedTuple):
    """Bounds of a motion; all are positive."""

    velocity: float  # highest speed
    acceleration: float  # while the speed grows
    deceleration: float  # while it shrinks


NO_BOUNDS = (-math.inf, math.inf)


class Axis:
    """Demand and motor of a drive, at one point in time."""

    def __init__(self, model: ServoModel) -> None:
        self.time = 0.0  # steady time of the state
        self.demand = 0.0  # position demanded now
        self.demand_velocity = 0.0  # velocity demanded now
        # when the demand changes its acceleration; NEVER at the end of a motion
        self.phase_end = NEVER
        self.position = 0.0  # where the motor is
        self.powered = False  # the motor has torque: the position loop is closed
        self.speed_limited = False  # the motor is behind a demand that was faster than it can turn
        self.speed = math.inf  # highest speed of the motor
        self.load = 0.0  # torque that it takes to hold the axis
        self.origin = 0.0  # where the mechanical zero is; homing moves it
        self.switches = Switches()  # where its switches are
        self._model = model
        self._stops = NO_BOUNDS
        self._setpoint = 0.0  # output of the rate limiter
        self._free_velocity = 0.0  # without torque
        self._acceleration = 0.0
        self._phase_velocity = 0.0  # at the end of the phase
        self._plan = self._constant
        self._target = 0.0  # position to stand at
        self._wanted = 0.0  # velocity to reach
        self._limits = Limits(math.inf, math.inf, math.inf)

    @property
    def velocity(self) -> float:
        """Actual velocity."""
        if not self.powered:
            return self._free_velocity
        return 0.0 if self.blocked else (self._setpoint - self.position) / self._model.lag

    @property
    def following_error(self) -> float:
        """Demand minus actual position."""
        return self.demand - self.position

    @property
    def blocked(self) -> bool:
        """Whether the position loop pushes the motor against a mechanical stop."""
        low, high = self._stops
        if not self.powered or low < self.position < high:
            return False
        gap = self._setpoint - self.position
        return (self.position >= high and gap > 0.0) or (self.position <= low and gap < 0.0)

    @property
    def arrived(self) -> bool:
        """Whether the demand has ended its motion or reached a constant velocity."""
        return self.phase_end == NEVER

    @property
    def settled(self) -> bool:
        """Whether demand and motor are at rest, and stay so without a command."""
        if not self.powered:
            return self._free_velocity == 0.0
        at_rest = self.phase_end == NEVER and self.demand_velocity == 0.0
        return at_rest and (abs(self.demand - self.position) < SETTLED or self.blocked)

    @property
    def torque(self) -> float:
        """Torque required by the demanded motion."""
        inertia = 0.0 if self.arrived else self._acceleration / TORQUE_GAIN
        return inertia + self.steady_torque if self.powered else 0.0

    @property
    def steady_torque(self) -> float:
        """Torque that keeps the velocity constant, and holds the load at rest."""
        if not self.powered:
            return 0.0
        velocity = self.velocity
        dry = math.copysign(DRY_FRICTION, velocity) if velocity else 0.0
        return dry + VISCOUS_FRICTION * velocity + self.load

    def set_stops(self, low: float, high: float) -> None:
        """Place mechanical stops at positions; infinite for none."""
        self._stops = (low, high)

    def power_on(self, deceleration: float) -> None:
        """Close the position loop at the motor position; ramp down a motor that still coasts."""
        self._setpoint = self.position + self._free_velocity * self._model.lag
        self.powered = True
        self.stop(deceleration)

    def power_off(self) -> None:
        """Open the position loop; the motor coasts against its brake."""
        self._free_velocity = self.velocity
        self.powered = self.speed_limited = False
        self._rest()

    def move(self, target: float, limits: Limits) -> None:
        """Move to a position and stop there, as fast as the limits allow."""
        self._target, self._limits = target, limits
        self._begin(self._move_phase)

    def ramp(
        self, velocity: float, limits: Limits, bounds: tuple[float, float] = NO_BOUNDS
    ) -> bool:
        """Ramp to a velocity and keep it, or stop at a position bound ahead.

        Returns:
            Whether the motion ends at a bound.
        """
        speed = min(abs(velocity), limits.velocity)
        self._wanted, self._limits = math.copysign(speed, velocity), limits
        bound = bounds[velocity > 0.0]
        bounded = velocity != 0.0 and math.isfinite(bound)
        if bounded and (bound - self._stopping_place(limits.deceleration)) * velocity > 0.0:
            self.move(bound, limits._replace(velocity=speed))
            return True
        if bounded:  # it cannot stop before the bound
            self._wanted = 0.0
        self._begin(self._ramp_phase)
        return bounded

    def line(self, target: float, duration: float) -> None:
        """Move to a position at constant velocity in a given time, then stop."""
        self._target = target
        self._plan = self._stand
        self.demand_velocity = (target - self.demand) / duration
        self._cruise(duration)

    def stop(self, deceleration: float) -> float:
        """Ramp down to a stop; return its position.

        The ramp begins at the motor position if the demand is far ahead, or is a cyclic set-point,
        which has no velocity.
        """
        if self.speed_limited or self.arrived:
            self.demand, self.demand_velocity = self._setpoint, self.velocity
        place = self._stopping_place(deceleration)
        self.ramp(0.0, Limits(math.inf, deceleration, deceleration))
        return place

    def push(self, torque: float) -> None:
        """Apply a torque for :data:`TORQUE_STEP`, then keep the velocity."""
        if self.blocked:
            self.demand, self.demand_velocity = self.position, 0.0
        velocity = self.demand_velocity
        holds = self.rests(torque)
        drive = torque - self.load
        rate = 0.0
        if velocity or not holds:
            dry = math.copysign(DRY_FRICTION, velocity or drive)
            rate = TORQUE_GAIN * (drive - dry - VISCOUS_FRICTION * velocity)
        end = velocity + rate * TORQUE_STEP
        if velocity * end < 0.0 and holds:
            end = 0.0  # friction brings it to rest, and does not turn it back
        end = min(max(end, -self.speed), self.speed)
        rate = max(abs(rate), abs(end - velocity) / TORQUE_STEP)  # more where it was too fast
        self.ramp(end, Limits(math.inf, rate, rate))

    def rests(self, torque: float) -> bool:
        """Return whether friction holds a motor at rest against a torque and the load."""
        return abs(torque - self.load) <= DRY_FRICTION

    def shift(self, offset: float) -> None:
        """Move the zero of the position by an offset; the motor does not turn."""
        self.origin += offset
        self.position += offset
        self._setpoint += offset
        self.demand += offset
        self._target += offset
        self._stops = (self._stops[0] + offset, self._stops[1] + offset)

    def advance(self, now: float) -> None:
        """Advance to a time; ignore earlier times."""
        while self.time < now:
            self.step(now)

    def step(self, until: float) -> None:
        """Advance to a time, or to the end of the present phase if that is earlier."""
        if self.settled:
            if self.powered and not self.blocked:
                self.position = self._setpoint = self.demand
            self.time = max(self.time, until)
        elif not self.powered:
            self._coast(until - self.time)
            self.time = until
            self._rest()
        else:
            until = min(until, self.phase_end)
            duration = until - self.time
            if self._behind(duration):
                duration = min(duration, LIMITER_STEP)
                until = min(until, self.time + duration)
                self._limit_rate(duration)
            else:
                self._follow(duration)
            self.time = until
        self._end_phases()

    def _begin(self, plan: Callable[[], None]) -> None:
        self._plan = plan
        plan()
        self._end_phases()

    def _end_phases(self) -> None:
        while self.phase_end <= self.time:
            self.demand_velocity = self._phase_velocity
            self._plan()

    def _ramp_phase(self) -> None:
        velocity, wanted, limits = self.demand_velocity, self._wanted, self._limits
        if velocity == wanted:
            self._constant()
        elif velocity * wanted < 0.0:
            self._accelerate(0.0, limits.deceleration)
        else:
            faster = abs(wanted) > abs(velocity)
            self._accelerate(wanted, limits.acceleration if faster else limits.deceleration)

    def _move_phase(self) -> None:
        top, up, down = self._limits
        velocity, way = self.demand_velocity, self._target - self.demand
        braking = velocity * velocity / (2.0 * down)
        if abs(way) < SETTLED and braking < SETTLED:
            self._stand()
            return
        # from here on towards positive positions
        sign = math.copysign(1.0, way - math.copysign(braking, velocity))
        velocity, way = sign * velocity, sign * way
        peak = math.sqrt(max(down * (2.0 * up * way + velocity * velocity) / (up + down), 0.0))
        peak = min(top, peak)
        if velocity < 0.0:  # moves away from the target, or cannot stop before it
            self._accelerate(0.0, down)
        elif velocity > top:
            self._accelerate(sign * top, down)
        elif velocity < peak * (1.0 - 1e-9):
            self._accelerate(sign * peak, up)
        elif way - braking > max(SETTLED, velocity * CRUISE_MIN):
            self._cruise((way - braking) / velocity)
        else:  # a little softer, where that is what ends at the target
            self._accelerate(0.0, min(down, velocity * velocity / (2.0 * way)) if way else down)

    def _accelerate(self, velocity: float, rate: float) -> None:
        change = velocity - self.demand_velocity
        self._acceleration = math.copysign(rate, change)
        self._phase_velocity = velocity
        self.phase_end = self.time + abs(change) / rate

    def _cruise(self, duration: float) -> None:
        self._acceleration = 0.0
        self._phase_velocity = self.demand_velocity
        self.phase_end = self.time + duration

    def _constant(self) -> None:
        self._cruise(NEVER)

    def _stand(self) -> None:
        self.demand, self.demand_velocity = self._target, 0.0
        self._constant()

    def _rest(self) -> None:
        """Set the demand to the motor position, so that nothing jumps at power-on."""
        self._target = self.position
        self._stand()

    def _stopping_place(self, deceleration: float) -> float:
        velocity = self.demand_velocity
        return self.demand + velocity * abs(velocity) / (2.0 * deceleration)

    def _coast(self, duration: float) -> None:
        coasting = self._model.coasting
        decay = math.exp(-duration / coasting)
        self.position += self._free_velocity * coasting * (1.0 - decay)
        self._free_velocity *= decay
        if self._halt_at_stops() or abs(self._free_velocity) * coasting < SETTLED:
            self._free_velocity = 0.0

    def _behind(self, duration: float) -> bool:
        """Return whether the motor cannot follow the demand during a time."""
        last = self.demand_velocity + self._acceleration * duration
        caught = abs(self.demand - self._setpoint) <= ROUNDING
        return not caught or abs(self.demand_velocity) > self.speed or abs(last) > self.speed

    def _advance_demand(self, duration: float) -> None:
        change = self._acceleration * duration
        self.demand += (self.demand_velocity + 0.5 * change) * duration
        self.demand_velocity += change

    def _follow(self, duration: float) -> None:
        """Move the motor after the demand (see the module)."""
        lag, acceleration = self._model.lag, self._acceleration
        bend = lag * lag * acceleration
        offset = self.position - (self.demand - lag * self.demand_velocity + bend)
        self._advance_demand(duration)
        self._setpoint = self.demand
        self.speed_limited = False
        self.position = self.demand - lag * self.demand_velocity + bend
        self.position += offset * math.exp(-duration / lag)
        self._halt_at_stops()

    def _limit_rate(self, duration: float) -> None:
        """Move the motor after the demand as far as its speed allows."""
        self._advance_demand(duration)
        lag, reach = self._model.lag, self.speed * duration
        gap = self.demand - self._setpoint
        moved = min(max(gap, -reach), reach)
        self.speed_limited = abs(gap - moved) > ROUNDING
        behind = lag * moved / duration if duration else 0.0
        offset = self.position - self._setpoint + behind
        self._setpoint = self._setpoint + moved if self.speed_limited else self.demand
        self.position = self._setpoint - behind + offset * math.exp(-duration / lag)
        self._halt_at_stops()

    def _halt_at_stops(self) -> bool:
        low, high = self._stops
        if low <= self.position <= high:
            return False
        self.position = min(max(self.position, low), high)
        return True
