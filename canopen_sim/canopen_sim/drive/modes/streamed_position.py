# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Modes in which the master streams positions: cyclic synchronous and interpolated position.

Both go from set-point to set-point at constant velocity (CiA 402-2, clauses 13 and 14).
"""

from __future__ import annotations

from abc import abstractmethod
from collections import deque

from arm_canopen import OperationMode
from arm_canopen.standard import Controlword, Statusword

from ..axis import Axis
from ..objects import DriveObjects, NO_WINDOW, PERIOD_MIN
from ..profile import plan_line
from .mode import SyncClock, TARGET_REACHED
from .streamed import Streamed

ENABLE_INTERPOLATION = int(Controlword.ENABLE_INTERPOLATION)
INTERPOLATION_ACTIVE = int(Statusword.INTERPOLATION_ACTIVE)


class StreamedPosition(Streamed):
    """Follows positions that come at regular times."""

    @property
    @abstractmethod
    def wanted(self) -> int:
        """The latest set-point in [inc]."""

    def take(self, period: float, now: float) -> bool:
        """Go to the set-point within a period."""
        return self.go(self.wanted, period, now)

    def go(self, wanted: int, period: float, now: float) -> bool:
        """Go to a position within a period; return whether the motion has changed."""
        axis = self.axis
        axis.advance(now)
        target = self.objects.within_limits(wanted, axis.demand.position)
        self.limited = target != wanted
        if axis.arrived and axis.demand.position == target:
            return False
        axis.follow(plan_line(axis.demand.position, target, max(period, PERIOD_MIN), now))
        return True


class CyclicPosition(StreamedPosition):
    """Cyclic synchronous position mode."""

    number = OperationMode.CYCLIC_POSITION

    @property
    def wanted(self) -> int:
        """Target position 0x607A plus the position offset 0x60B0."""
        return self.objects.target_position.value + self.objects.position_offset.value


class InterpolatedPosition(StreamedPosition):
    """Interpolated position mode, linear; bit 4 of the controlword enables it.

    With a buffer of more than one record (0x60C4:02) the set-points wait in it, and each SYNC
    takes one. Writing 0 to 0x60C4:06 empties it and keeps it shut until 1 is written.
    """

    number = OperationMode.INTERPOLATED_POSITION

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncClock) -> None:
        super().__init__(objects, axis, clock)
        self._enabled = False
        self._buffer: deque[int] = deque()
        objects.buffer_clear.listener = self._on_clear

    @property
    def wanted(self) -> int:
        """Interpolation data record 0x60C1:01."""
        return self.objects.interpolation_target.value

    @property
    def following(self) -> bool:
        """Set-points are applied."""
        return self._enabled and not self.halted

    def start(self, word: int, now: float) -> None:
        """Stand still; bit 4 may be set already."""
        super().start(word, now)
        self._buffer.clear()
        self._enabled = bool(word & ENABLE_INTERPOLATION)

    def setpoint(self, now: float) -> bool:
        """Keep the set-point for its SYNC, or take it."""
        size = min(self.objects.buffer_size.value, self.objects.buffer_maximum.value)
        if not self.objects.buffer_clear.value:
            return False
        if size > 1 and self.clock.alive(now):
            if self.following and len(self._buffer) < size:
                self._buffer.append(self.wanted)
            return False
        return super().setpoint(now)

    def sync(self, now: float) -> bool:
        """Take the oldest set-point of the buffer, or the one since the last SYNC."""
        if not self._buffer:
            return super().sync(now)
        if not self.following:
            return False
        return self.go(self._buffer.popleft(), self.clock.period, now)

    def _on_clear(self, _now: float) -> None:
        if not self.objects.buffer_clear.value:
            self._buffer.clear()
            self._fresh = False

    def halt(self, now: float) -> None:
        """Forget what was not taken."""
        super().halt(now)
        self._buffer.clear()

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
