# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Homing mode with the methods that need no switch (CiA 402-2, clause 11)."""

from __future__ import annotations

from ...standard.drive import Controlword, OperationMode, Statusword
from ..axis import Axis
from ..drive_objects import DriveObjects
from .mode import Mode, SyncClock, TARGET_REACHED

HOMING_START = int(Controlword.HOMING_START)
ATTAINED = int(Statusword.HOMING_ATTAINED)
HOMING_ERROR = int(Statusword.HOMING_ERROR)

NO_HOMING = 0
PRESENT_POSITION_METHODS = frozenset({35, 37})
"""The present position becomes home (CiA 402-2, table of homing methods)."""


class Homing(Mode):
    """Finds home: where the motor stands becomes the home offset 0x607C.

    Method 0 attains home without changing anything. A method that the drive has not ends in
    "homing error".
    """

    number = OperationMode.HOMING

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncClock) -> None:
        """Begin not homed."""
        super().__init__(objects, axis, clock)
        self._attained = False
        self._failed = False

    def reset(self) -> None:
        """Be not homed, as after switching on."""
        self._attained = self._failed = False

    def start(self, word: int, now: float) -> None:
        """Stand still and wait for the start; an earlier error is over."""
        super().start(word, now)
        self._failed = False

    def command(self, word: int, previous: int, now: float) -> None:
        """Home at the rising edge of bit 4."""
        if not word & ~previous & HOMING_START or self.halted:
            return
        method = self.objects.homing_method.value
        if method in PRESENT_POSITION_METHODS:
            self.axis.shift(self.objects.home_offset.value - self.axis.position)
        self._attained = method in PRESENT_POSITION_METHODS or method == NO_HOMING
        self._failed = not self._attained

    def status(self) -> int:
        """Return "target reached", "homing attained" and "homing error"."""
        word = TARGET_REACHED if self.axis.settled else 0
        if self._attained:
            word |= ATTAINED
        return word | (HOMING_ERROR if self._failed else 0)
