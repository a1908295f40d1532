# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes of operation, and those with a profile of the drive's own (CiA 402-2, clauses 9, 10, 12).

A mode moves the axis while the drive is enabled.
"""

from __future__ import annotations

import math
from typing import ClassVar, NamedTuple

from canopen_core.standard import Controlword, OperationMode, Statusword

from ..messages import SyncConsumer
from ..object_store import NEVER
from .axis import Axis, Limits
from .objects import DriveObjects, MILLISECOND, NO_WINDOW

TARGET_REACHED = int(Statusword.TARGET_REACHED)


class Mode:
    """Base of the modes of operation; unless overridden, it holds the axis in place.

    The drive calls it only while operation is enabled, with the axis at the time ``now`` unless
    a method documents otherwise.
    """

    number: ClassVar[OperationMode]  # its value of 0x6060

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncConsumer) -> None:
        self.objects = objects
        self.axis = axis
        self.clock = clock
        self.halted = False  # bit 8 of the controlword is set; the axis ramps down or stands
        self.limited = False  # a software position limit holds the demand back
        self.due = NEVER  # steady time in [s] at which a step of the axis has to end

    @property
    def waiting(self) -> bool:
        """Whether the status may still change as time passes."""
        return False

    @property
    def torque(self) -> float | None:
        """Applied torque in [0.1 % of the rated torque]; None while a position is held."""
        return None

    def reset(self) -> None:
        """Clear all state, as after power-on."""

    def start(self, word: int, now: float) -> None:
        """Start: a controlword enabled operation, or the mode was selected while enabled."""
        self.limited = False
        self.due = NEVER
        self.axis.stop(self.objects.slow_down)

    def command(self, word: int, previous: int, now: float) -> None:
        """React to mode-specific bits of the controlword that changed."""

    def halt(self, now: float) -> None:
        """Halt was requested; the axis is ramping down already."""

    def resume(self, now: float) -> None:
        """Halt is over."""

    def load_changed(self, now: float) -> None:
        """React to another load torque."""

    def setpoint(self, now: float) -> bool:
        """React to a written target, the axis at an earlier time; return whether it moves."""
        return False

    def sync(self, now: float) -> bool:
        """React to SYNC, the axis at an earlier time; return whether the motion has changed."""
        return False

    def step(self, now: float) -> None:
        """Check the axis after it made a step."""

    def status(self) -> int:
        """Return bits 10, 12 and 13 of the statusword."""
        return 0


class NoMode(Mode):
    """Mode 0: none is selected, the axis is held."""

    number = OperationMode.NO_MODE


class Dwell:
    """Detects when a condition has held for a time."""

    def __init__(self) -> None:
        self.reached = False  # it has
        self.pending = False  # it holds, but not for long enough
        self._since = 0.0

    def clear(self) -> None:
        """Restart the time."""
        self.reached = self.pending = False

    def update(self, condition: bool, duration: float, now: float) -> None:
        """Check the condition, which has to be met for a duration in [s]."""
        if not condition:
            self.clear()
            return
        if not self.pending and not self.reached:
            self._since = now
        self.reached = self.reached or now - self._since >= duration
        self.pending = not self.reached


ENABLE_RAMP = 0x10  # without it the drive slows down
UNLOCK_RAMP = 0x20  # without it the velocity stays as it is
REFERENCE_RAMP = 0x40  # without it the ramp leads to zero


class Velocity(Mode):
    """Ramps to 0x6042 by 0x6048 and 0x6049, within 0x6046.

    Bits 4, 5 and 6 of the controlword all have to be set for that.
    """

    number = OperationMode.VELOCITY

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncConsumer) -> None:
        super().__init__(objects, axis, clock)
        self._word = 0
        self._wanted = 0.0

    def start(self, word: int, now: float) -> None:
        """Ramp to the target velocity as it stands in the dictionary."""
        super().start(word, now)
        self._word = word
        if not self.halted:
            self.resume(now)

    def command(self, word: int, previous: int, now: float) -> None:
        """Apply the ramp bits."""
        changed = (word ^ self._word) & (ENABLE_RAMP | UNLOCK_RAMP | REFERENCE_RAMP)
        self._word = word
        if changed and not self.halted:
            self.resume(now)

    def resume(self, now: float) -> None:
        """Ramp to the velocity that controlword and target select."""
        limits = self.objects.velocity_mode_limits
        self._wanted = self._reference(limits.velocity)
        if self._word & ENABLE_RAMP:
            self.axis.ramp(self._wanted, limits, self.objects.position_limits())
        else:
            self.axis.stop(self.objects.slow_down)

    def setpoint(self, now: float) -> bool:
        """Ramp to another target velocity."""
        if self.halted:
            return False
        self.axis.advance(now)
        self.resume(now)
        return True

    def _reference(self, highest: float) -> float:
        if not self._word & ENABLE_RAMP or not self._word & REFERENCE_RAMP:
            self.limited = False
            return 0.0
        if not self._word & UNLOCK_RAMP:
            return self.axis.demand_velocity
        target = float(self.objects.vl_target.value)
        amount = min(max(abs(target), float(self.objects.vl_min.value)), highest)
        held = math.copysign(amount, target) if target else 0.0
        self.limited = held != target
        return held

    def status(self) -> int:
        """Return "target reached"."""
        reached = self.axis.arrived and self.axis.demand_velocity == self._wanted
        return TARGET_REACHED if reached else 0


ZERO_SPEED = int(Statusword.ZERO_SPEED)
SLIPPAGE_ERROR = 0x2000  # bit 13 of the statusword


class ProfileVelocity(Mode):
    """Ramps to the target velocity, and stops at the software position limits."""

    number = OperationMode.PROFILE_VELOCITY

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncConsumer) -> None:
        super().__init__(objects, axis, clock)
        self._target = 0.0
        self._bounded = False  # the motion ends at a software limit
        self._reached = Dwell()
        self._standing = Dwell()

    @property
    def waiting(self) -> bool:
        """Whether a velocity is in its window, but not yet for long enough."""
        return self._reached.pending or self._standing.pending

    def start(self, word: int, now: float) -> None:
        """Ramp to the target velocity as it stands in the dictionary."""
        self._reached.clear()
        self._standing.clear()
        if self.halted:
            super().start(word, now)
        else:
            self.resume(now)

    def resume(self, now: float) -> None:
        """Ramp to the target velocity."""
        objects = self.objects
        self._target = float(objects.target_velocity.value)
        self._reached.clear()
        limits = objects.profile(objects.speed)
        self._bounded = self.axis.ramp(self._target, limits, objects.position_limits())

    def setpoint(self, now: float) -> bool:
        """Ramp to another target velocity."""
        if self.halted or self.objects.target_velocity.value == self._target:
            return False
        self.axis.advance(now)
        self.resume(now)
        return True

    def step(self, now: float) -> None:
        """Check whether the velocity is reached, and whether it is zero."""
        objects, velocity = self.objects, self.axis.velocity
        self.limited = self._bounded and self.axis.arrived
        wanted = math.copysign(min(abs(self._target), objects.speed), self._target)
        self._reached.update(
            abs(velocity - wanted) <= objects.velocity_window.value,
            objects.velocity_window_time.value * MILLISECOND,
            now,
        )
        self._standing.update(
            abs(velocity) <= objects.velocity_threshold.value,
            objects.velocity_threshold_time.value * MILLISECOND,
            now,
        )

    def status(self) -> int:
        """Return "target reached", "zero speed" and "max slippage error"."""
        zero = ZERO_SPEED if self._standing.reached else 0
        slip = self.objects.max_slippage.value
        if 0 < slip < abs(self.axis.demand_velocity - self.axis.velocity):
            zero |= SLIPPAGE_ERROR
        return zero | (TARGET_REACHED if self._reached.reached else 0)


NEW_SET_POINT = int(Controlword.NEW_SET_POINT)
CHANGE_IMMEDIATELY = int(Controlword.CHANGE_IMMEDIATELY)
RELATIVE = int(Controlword.RELATIVE)
BLEND = int(Controlword.CHANGE_ON_SET_POINT)
ACKNOWLEDGE = int(Statusword.SET_POINT_ACKNOWLEDGE)


class SetPoint(NamedTuple):
    """A target, and the profile parameters at the time of its set-point."""

    target: float  # where to go in [inc], within the software limits
    limits: Limits  # velocity, acceleration and deceleration
    clipped: bool  # the software limits changed the target
    blended: bool  # the move before passes its own target without a stop (bit 9)


class ProfilePosition(Mode):
    """Moves to targets by trapezoidal profiles.

    At a rising edge of "new set-point" the drive accepts the target, and confirms it by
    "set-point acknowledge". During a move, one further set-point is buffered and started when
    the move has ended, unless "change immediately" makes it replace the present one. The
    acknowledge bit stays set until the master has cleared its bit and the drive can accept
    another set-point.

    With "change on set-point" the present move passes its target without a stop if the buffered
    set-point lies far enough in the same direction; otherwise it stops there. The present step
    ends at the target.
    """

    number = OperationMode.PROFILE_POSITION

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncConsumer) -> None:
        super().__init__(objects, axis, clock)
        self._active: SetPoint | None = None
        self._next: SetPoint | None = None
        self._preceding = 0.0  # target that a relative one counts from
        self._offered = False  # the master's bit of an accepted set-point is still set
        self._dwell = Dwell()

    @property
    def waiting(self) -> bool:
        """Whether the target is in its window, but not yet for long enough."""
        return self._dwell.pending

    def start(self, word: int, now: float) -> None:
        """Stop and wait for a set-point."""
        self.limited = self._offered = False
        self.due = NEVER
        self._active = self._next = None
        self._preceding = self.axis.stop(self.objects.slow_down)
        self._dwell.clear()

    def command(self, word: int, previous: int, now: float) -> None:
        """Accept a set-point at the rising edge of bit 4."""
        if word & ~previous & NEW_SET_POINT:
            self._offer(word, now)
        elif not word & NEW_SET_POINT:
            self._offered = False

    @property
    def _arriving(self) -> bool:
        """Whether the active move has not ended yet."""
        return self.due < NEVER or not self.axis.arrived

    def _offer(self, word: int, now: float) -> None:
        setpoint = self._setpoint(word)
        if self._active is None or not self._arriving or word & CHANGE_IMMEDIATELY:
            self._next = None
            self._begin(setpoint)
        elif self._next is None:
            self._next = setpoint
            self._pass_target(now)
        else:  # no room: the acknowledge bit stays set
            return
        self._offered = True
        self._preceding = setpoint.target

    def _setpoint(self, word: int) -> SetPoint:
        objects = self.objects
        target = float(objects.target_position.value)
        if word & RELATIVE:
            target += self._preceding
        within = objects.within_limits(target, self.axis.demand)
        limits = objects.profile(float(objects.profile_velocity.value))
        return SetPoint(within, limits, within != target, bool(word & BLEND))

    def _begin(self, setpoint: SetPoint) -> None:
        self._active = setpoint
        self.due = NEVER
        self.limited = setpoint.clipped
        self._dwell.clear()
        if self.halted:
            return
        if setpoint.limits.velocity > 0.0:
            self.axis.move(setpoint.target, setpoint.limits)
        else:  # a profile velocity of 0 leads nowhere
            self.axis.stop(setpoint.limits.deceleration)

    def _pass_target(self, now: float) -> None:
        """Pass the present target towards the next one, if requested."""
        active, following = self._active, self._next
        if active is None or following is None or not following.blended or self.halted:
            return
        axis, (top, up, down) = self.axis, active.limits
        way = active.target - axis.demand
        after = following.target - active.target
        if way * after <= 0.0 or way * axis.demand_velocity < 0.0 or not top:
            return
        speed = abs(axis.demand_velocity)
        rate = math.copysign(up if top > speed else down, top - speed)
        ramp = (top * top - speed * speed) / (2.0 * rate)  # [inc] until the speed is reached
        rest = abs(way) - ramp
        passing = top if rest >= 0.0 else math.sqrt(speed * speed + 2.0 * rate * abs(way))
        if passing * passing / (2.0 * following.limits.deceleration) <= abs(after):
            # otherwise it would overrun the next target
            self.due = now + (passing - speed) / rate + max(rest, 0.0) / top
            axis.ramp(math.copysign(top, way), active.limits)

    def halt(self, now: float) -> None:
        """Stay at rest until :meth:`resume`."""
        self.due = NEVER

    def resume(self, now: float) -> None:
        """Continue the halted move."""
        if self._active is not None:
            self._begin(self._active)
            self._pass_target(now)

    def step(self, now: float) -> None:
        """Start the next move when the present one ends; check whether the target is reached."""
        axis = self.axis
        following = None if self.halted else self._next
        if following is not None and (now >= self.due or not self._arriving):
            self._next = None
            self._begin(following)
        window = self.objects.position_window.value
        target = self._active.target if self._active else axis.demand
        there = axis.arrived and axis.demand == target
        there = there and (window == NO_WINDOW or abs(axis.position - target) <= window)
        delay = self.objects.position_window_time.value * MILLISECOND
        self._dwell.update(there and self._next is None, delay, now)

    def status(self) -> int:
        """Return "target reached" and "set-point acknowledge"."""
        acknowledge = ACKNOWLEDGE if self._offered or self._next is not None else 0
        return acknowledge | (TARGET_REACHED if self._dwell.reached else 0)
