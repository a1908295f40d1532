# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes in which the master streams positions: cyclic synchronous and interpolated position.

Both go from set-point to set-point at constant velocity (CiA 402-2, clauses 13 and 14). While
SYNC comes regularly, a set-point that was written is taken at the next SYNC; otherwise at once.
It shall be reached when the next one is due: after the period of SYNC when there was one for
each SYNC, else after the interpolation time period 0x60C2.
"""

from __future__ import annotations

from abc import abstractmethod

from ...standard.drive import Controlword, OperationMode, Statusword
from ..axis import Axis
from ..drive_objects import DriveObjects, NO_WINDOW, PERIOD_MIN
from ..object_store import Integer
from ..profile import plan_line
from .mode import Mode, SyncClock, TARGET_REACHED

ENABLE_INTERPOLATION = int(Controlword.ENABLE_INTERPOLATION)
FOLLOWS_COMMAND = int(Statusword.FOLLOWS_COMMAND)
INTERPOLATION_ACTIVE = int(Statusword.INTERPOLATION_ACTIVE)


class StreamedPosition(Mode):
    """Follows positions that come at regular times.

    A drive that is enabled stands still until the first set-point is written; what the target
    object held before is no set-point.
    """

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncClock) -> None:
        """Begin without a set-point."""
        super().__init__(objects, axis, clock)
        self._fresh = False  # written since the last SYNC
        self._streaming = False  # there was one for the SYNC before

    @property
    @abstractmethod
    def target(self) -> Integer:
        """The object that the set-points are written to."""

    @property
    def following(self) -> bool:
        """Set-points are obeyed."""
        return not self.halted

    def start(self, word: int, now: float) -> None:
        """Stand still and wait for a set-point."""
        super().start(word, now)
        self._fresh = self._streaming = False

    def halt(self, now: float) -> None:
        """Forget a set-point that was not taken."""
        self._fresh = self._streaming = False

    def setpoint(self, now: float) -> bool:
        """Keep the set-point for the next SYNC, or take it."""
        if not self.following:
            return False
        if self.clock.alive(now):
            self._fresh = True
            return False
        return self._take(self.objects.setpoint_period, now)

    def sync(self, now: float) -> bool:
        """Take the set-point that came since the last SYNC."""
        fresh, self._fresh = self._fresh, False
        steady, self._streaming = self._streaming and fresh, fresh
        if not fresh:
            return False
        period = self.clock.period if steady else 0.0
        return self._take(period or self.objects.setpoint_period, now)

    def _take(self, period: float, now: float) -> bool:
        wanted = self.target.value
        target = self.objects.within_limits(wanted)
        self.limited = target != wanted
        axis = self.axis
        axis.advance(now)
        if axis.arrived and axis.demand.position == target:
            return False
        axis.follow(plan_line(axis.demand.position, target, max(period, PERIOD_MIN), now))
        return True


class CyclicPosition(StreamedPosition):
    """Cyclic synchronous position mode."""

    number = OperationMode.CYCLIC_POSITION

    @property
    def target(self) -> Integer:
        """Target position 0x607A."""
        return self.objects.target_position

    def status(self) -> int:
        """Return "drive follows the command value"."""
        return FOLLOWS_COMMAND if self.following and not self.limited else 0


class InterpolatedPosition(StreamedPosition):
    """Interpolated position mode, linear; bit 4 of the controlword enables it."""

    number = OperationMode.INTERPOLATED_POSITION

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncClock) -> None:
        """Begin disabled."""
        super().__init__(objects, axis, clock)
        self._enabled = False

    @property
    def target(self) -> Integer:
        """Interpolation data record 0x60C1:01."""
        return self.objects.interpolation_target

    @property
    def following(self) -> bool:
        """Set-points are obeyed."""
        return self._enabled and not self.halted

    def start(self, word: int, now: float) -> None:
        """Stand still; bit 4 may be set already."""
        super().start(word, now)
        self._enabled = bool(word & ENABLE_INTERPOLATION)

    def command(self, word: int, previous: int, now: float) -> None:
        """Enable or disable interpolation."""
        enabled = bool(word & ENABLE_INTERPOLATION)
        if enabled is not self._enabled:
            self._enabled = enabled
            self.halt(now)
            self.axis.stop(self.objects.slow_down)

    def status(self) -> int:
        """Return "target reached" and "interpolation active"."""
        window = self.objects.position_window.value
        near = window == NO_WINDOW or abs(self.axis.following_error) <= window
        reached = TARGET_REACHED if self.axis.arrived and near else 0
        return reached | (INTERPOLATION_ACTIVE if self.following else 0)
