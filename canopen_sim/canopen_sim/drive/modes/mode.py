# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a mode of operation is: it moves the axis while the drive is enabled."""

from __future__ import annotations

from typing import ClassVar

from canopen_core.standard import OperationMode, Statusword

from ...services.sync_consumer import SyncConsumer
from ...timed import NEVER
from ..axis import Axis
from ..objects import DriveObjects

TARGET_REACHED = int(Statusword.TARGET_REACHED)


class Mode:
    """A mode of operation. Without anything overridden, the axis is held where it is.

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
        """Some time has to pass before its status is final."""
        return False

    @property
    def torque(self) -> float | None:
        """Torque that it applies in [0.1 % of the rated torque]; None when a position is held."""
        return None

    def reset(self) -> None:
        """Forget everything, as after switching on."""

    def start(self, word: int, now: float) -> None:
        """Begin: operation was enabled with a controlword, or the mode was selected then."""
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
        """Check the axis after a step of it."""

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
        """Begin again."""
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
