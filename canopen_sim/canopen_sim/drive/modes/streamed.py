# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What all modes have in common in which the master streams set-points (CiA 402-2).

While SYNC comes regularly, a set-point that was written is taken at the next SYNC; otherwise at
once. It holds until the next one is due: for the period of SYNC when there was one for each
SYNC, else for the interpolation time period 0x60C2.
"""

from __future__ import annotations

from abc import abstractmethod

from arm_canopen.standard import Statusword

from ..axis import Axis
from ..objects import DriveObjects
from .mode import Mode, SyncClock

FOLLOWS_COMMAND = int(Statusword.FOLLOWS_COMMAND)


class Streamed(Mode):
    """Follows set-points that come at regular times.

    A drive that is enabled stands still until the first set-point is written; what the target
    object held before is no set-point.
    """

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncClock) -> None:
        super().__init__(objects, axis, clock)
        self._fresh = False  # written since the last SYNC
        self._streaming = False  # there was one for the SYNC before

    @property
    def following(self) -> bool:
        """Set-points are applied."""
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
        return self.take(self.objects.setpoint_period, now)

    def sync(self, now: float) -> bool:
        """Take the set-point that came since the last SYNC."""
        fresh, self._fresh = self._fresh, False
        steady, self._streaming = self._streaming and fresh, fresh
        if not fresh:
            return False
        period = self.clock.period if steady else 0.0
        return self.take(period or self.objects.setpoint_period, now)

    @abstractmethod
    def take(self, period: float, now: float) -> bool:
        """Apply the set-point.

        Args:
            period: When the next one is due in [s].
            now: Steady time in [s]; the axis may be at an earlier one.

        Returns:
            The motion has changed.
        """

    def status(self) -> int:
        """Return "drive follows the command value"."""
        return FOLLOWS_COMMAND if self.following and not self.limited else 0
