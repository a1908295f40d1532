# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Profile velocity mode (CiA 402-2, clause 12)."""

from __future__ import annotations

import math

from canopen_core.standard import OperationMode, Statusword

from ...services.sync_consumer import SyncConsumer
from ..axis import Axis
from ..objects import DriveObjects, MILLISECOND
from .mode import Dwell, Mode, TARGET_REACHED

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
        """A velocity is in its window, but not yet for long enough."""
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
