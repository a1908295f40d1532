# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Profile position mode with the set-point handshake (CiA 402-2, clause 10)."""

from __future__ import annotations

import math
from typing import NamedTuple

from arm_canopen import OperationMode
from arm_canopen.standard import Controlword, Statusword

from ...timed import NEVER
from ..axis import Axis
from ..objects import DriveObjects, MILLISECOND, NO_WINDOW
from ..profile import Limits, plan_move, plan_velocity
from .mode import Dwell, Mode, SyncClock, TARGET_REACHED

NEW_SET_POINT = int(Controlword.NEW_SET_POINT)
CHANGE_IMMEDIATELY = int(Controlword.CHANGE_IMMEDIATELY)
RELATIVE = int(Controlword.RELATIVE)
BLEND = int(Controlword.CHANGE_ON_SET_POINT)
ACKNOWLEDGE = int(Statusword.SET_POINT_ACKNOWLEDGE)


class SetPoint(NamedTuple):
    """A target, and the profile parameters as they were when it was handed over.

    Attributes:
        target: Where to go in [inc], within the software limits.
        limits: Velocity, acceleration and deceleration.
        clipped: The software limits changed the target.
        blended: The move before passes its own target without a stop (bit 9).
    """

    target: float
    limits: Limits
    clipped: bool
    blended: bool


class ProfilePosition(Mode):
    """Moves to targets by trapezoidal profiles.

    A rising edge of "new set-point" hands the target over, "set-point acknowledge" confirms it.
    While a move is under way, one further set-point is kept and started when the move has
    ended, unless "change immediately" lets it take the place of the present one. The
    acknowledge bit stays set until the master has taken its bit back and there is room for
    another set-point.

    With "change on set-point" the present move passes its target without a stop, where the
    further set-point lies far enough in the same direction; otherwise it stops there.
    """

    number = OperationMode.PROFILE_POSITION

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncClock) -> None:
        super().__init__(objects, axis, clock)
        self._active: SetPoint | None = None
        self._next: SetPoint | None = None
        self._preceding = 0.0  # target that a relative one counts from
        self._offered = False  # the master's bit of an accepted set-point is still set
        self._passing = NEVER  # when the present target is passed without a stop
        self._dwell = Dwell()

    @property
    def next_event(self) -> float:
        """End of a move after which another one waits, or its target may be reached."""
        if self._active is None or self.halted:
            return NEVER
        if self._next is not None and self._passing < NEVER:
            return self._passing
        return NEVER if self.axis.arrived else self.axis.motion.end

    @property
    def waiting(self) -> bool:
        """The target is in its window, but not yet for long enough."""
        return self._dwell.pending

    def start(self, word: int, now: float) -> None:
        """Stand still and wait for a set-point."""
        super().start(word, now)
        self._active = self._next = None
        self._passing = NEVER
        self._offered = False
        self._preceding = self.axis.motion.at(self.axis.motion.end).position
        self._dwell.clear()

    def command(self, word: int, previous: int, now: float) -> None:
        """Take a set-point at the rising edge of bit 4."""
        if word & ~previous & NEW_SET_POINT:
            self._offer(word, now)
        elif not word & NEW_SET_POINT:
            self._offered = False

    def _offer(self, word: int, now: float) -> None:
        setpoint = self._setpoint(word)
        busy = self._active is not None and not self.axis.arrived
        if not busy or word & CHANGE_IMMEDIATELY:
            self._next = None
            self._begin(setpoint, now)
        elif self._next is None:
            self._next = setpoint
            self._pass_target(now)
        else:  # no room: the acknowledge bit stays set
            return
        self._offered = True
        self._preceding = setpoint.target

    def _setpoint(self, word: int) -> SetPoint:
        target = float(self.objects.target_position.value)
        if word & RELATIVE:
            target += self._preceding
        within = self.objects.within_limits(target, self.axis.demand.position)
        velocity = float(self.objects.profile_velocity.value)
        return SetPoint(
            within, self.objects.profile(velocity), within != target, bool(word & BLEND)
        )

    def _begin(self, setpoint: SetPoint, now: float) -> None:
        self._active = setpoint
        self._passing = NEVER
        self.limited = setpoint.clipped
        self._dwell.clear()
        if self.halted:
            return
        if setpoint.limits.velocity > 0.0:
            self.axis.follow(plan_move(self.axis.demand, setpoint.target, setpoint.limits, now))
        else:  # a profile velocity of 0 leads nowhere
            self.axis.stop(setpoint.limits.deceleration)

    def _pass_target(self, now: float) -> None:
        """Go through the present target to the next one, if that was requested."""
        active, following = self._active, self._next
        if active is None or following is None or not following.blended or self.halted:
            return
        start = self.axis.demand
        way = active.target - start.position
        if way * (following.target - active.target) <= 0.0 or way * start.velocity < 0.0:
            return
        limits = active.limits
        if not limits.velocity:
            return
        cruise = plan_velocity(start, math.copysign(limits.velocity, way), limits, now)
        passing = cruise.time_at(active.target)
        if passing == NEVER:
            return
        braking = cruise.at(passing).velocity ** 2 / (2.0 * following.limits.deceleration)
        if braking <= abs(following.target - active.target):  # else it would overrun
            self._passing = passing
            self.axis.follow(cruise)

    def resume(self, now: float) -> None:
        """Go on with the move that was halted."""
        if self._active is not None:
            self._begin(self._active, now)
            self._pass_target(now)

    def event(self, now: float) -> None:
        """Begin the next move where the present one ends."""
        if self._next is not None:
            setpoint, self._next = self._next, None
            self._begin(setpoint, now)
            self._pass_target(now)

    def update(self, now: float) -> None:
        """See whether the target is reached."""
        window = self.objects.position_window.value
        target = self._active.target if self._active else self.axis.demand.position
        error = abs(self.axis.position - target)
        there = self.axis.arrived and (window == NO_WINDOW or error <= window)
        there = there and (self._active is None or self.axis.demand.position == target)
        delay = self.objects.position_window_time.value * MILLISECOND
        self._dwell.update(there and self._next is None, delay, now)

    def status(self) -> int:
        """Return "target reached" and "set-point acknowledge"."""
        acknowledge = ACKNOWLEDGE if self._offered or self._next is not None else 0
        return acknowledge | (TARGET_REACHED if self._dwell.reached else 0)
