# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Velocity mode, that of frequency converters (CiA 402-2, clause 9)."""

from __future__ import annotations

import math

from canopen_core.standard import OperationMode

from ...services.sync_consumer import SyncConsumer
from ..axis import Axis
from ..objects import DriveObjects
from .mode import Mode, TARGET_REACHED

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
