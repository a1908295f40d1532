# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Profile position mode with the set-point handshake (CiA 402-2, clause 10)."""

from __future__ import annotations

import math
from typing import NamedTuple

from canopen_core.standard import Controlword, OperationMode, Statusword

from ...services.sync_consumer import SyncConsumer
from ...timed import NEVER
from ..axis import Axis, Limits
from ..objects import DriveObjects, MILLISECOND, NO_WINDOW
from .mode import Dwell, Mode, TARGET_REACHED

NEW_SET_POINT = int(Controlword.NEW_SET_POINT)
CHANGE_IMMEDIATELY = int(Controlword.CHANGE_IMMEDIATELY)
RELATIVE = int(Controlword.RELATIVE)
BLEND = int(Controlword.CHANGE_ON_SET_POINT)
ACKNOWLEDGE = int(Statusword.SET_POINT_ACKNOWLEDGE)


class SetPoint(NamedTuple):
    """A target, and the profile parameters as they were when it was handed over."""

    target: float  # where to go in [inc], within the software limits
    limits: Limits  # velocity, acceleration and deceleration
    clipped: bool  # the software limits changed the target
    blended: bool  # the move before passes its own target without a stop (bit 9)


class ProfilePosition(Mode):
    """Moves to targets by trapezoidal profiles.

    A rising edge of "new set-point" hands the target over, "set-point acknowledge" confirms it.
    While a move is under way, one further set-point is kept and started when the move has
    ended, unless "change immediately" lets it take the place of the present one. The
    acknowledge bit stays set until the master has taken its bit back and there is room for
    another set-point.

    With "change on set-point" the present move passes its target without a stop, where the
    further set-point lies far enough in the same direction; otherwise it stops there. The step
    that is due ends at the target.
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
        """The target is in its window, but not yet for long enough."""
        return self._dwell.pending

    def start(self, word: int, now: float) -> None:
        """Stand still and wait for a set-point."""
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
        """The active move has not come to its end."""
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
        """Go through the present target to the next one, if that was requested."""
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
        """Stand until :meth:`resume`."""
        self.due = NEVER

    def resume(self, now: float) -> None:
        """Go on with the move that was halted."""
        if self._active is not None:
            self._begin(self._active)
            self._pass_target(now)

    def step(self, now: float) -> None:
        """Begin the next move where the present one ends; see whether the target is reached."""
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
