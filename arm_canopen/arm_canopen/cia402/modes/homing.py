# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Mode 6, homing: bit 4 starts the method of 0x6098, and the drive shows its end (clause 11)."""

from __future__ import annotations

from canopen_core import DriveError
from canopen_core.standard import Controlword, OperationMode

from ...master.scheduler import completed, Promise
from ..state import Actual
from .mode import Mode, NO_BITS


class Homing(Mode):
    """Mode 6: bit 4 is set while the drive homes."""

    number = OperationMode.HOMING

    def __init__(self) -> None:
        self.started = False  # whether bit 4 is set

    def preload(self, actual: Actual) -> Promise[None]:
        """Preload nothing: without bit 4 nothing moves."""
        self.started = False
        return completed()

    def set_target(self, target: float) -> Promise[None]:
        """Refuse every target."""
        raise DriveError('the drive is homing and takes no target')

    def step(self, now: float, period: float, statusword: int) -> int:
        """Keep bit 4 while homing runs."""
        return Controlword.HOMING_START if self.started else NO_BITS
