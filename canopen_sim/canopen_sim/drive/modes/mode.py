# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a mode of operation is: it moves the axis while the drive is enabled."""

from __future__ import annotations

from typing import ClassVar, Protocol

from arm_canopen import OperationMode
from arm_canopen.standard import Statusword

from ...timed import NEVER
from ..axis import Axis
from ..objects import DriveObjects


class SyncClock(Protocol):
    """What a drive knows of SYNC."""

    @property
    def period(self) -> float:
        """Time between two SYNCs in [s], 0 when unknown."""

    def alive(self, now: float) -> bool:
        """Return whether SYNC comes regularly at this time."""


class Mode:
    """A mode of operation. Without anything overridden, the axis is held where it is.

    The drive calls it only while operation is enabled, with the axis at the time ``now`` unless
    a method documents otherwise.

    Attributes:
        number: Its value of 0x6060.
        halted: Bit 8 of the controlword is set; the axis ramps down or stands.
        limited: A software position limit holds the demand back.
    """

    number: ClassVar[OperationMode]

    def __init__(self, objects: DriveObjects, axis: Axis, clock: SyncClock) -> None:
        self.objects = objects
        self.axis = axis
        self.clock = clock
        self.halted = False
        self.limited = False

    @property
    def next_event(self) -> float:
        """Steady time in [s] at which :meth:`event` has to be called, exactly then."""
        return NEVER

    @property
    def waiting(self) -> bool:
        """Some time has to pass before its status is final."""
        return False

    def reset(self) -> None:
        """Forget everything, as after switching on."""

    def start(self, word: int, now: float) -> None:
        """Begin: operation was enabled, or the mode was selected while it was.

        Args:
            word: The controlword.
            now: Steady time in [s].
        """
        self.limited = False
        self.axis.stop(self.objects.slow_down)

    def command(self, word: int, previous: int, now: float) -> None:
        """See the controlword change in its mode-specific bits."""

    def halt(self, now: float) -> None:
        """Halt was requested; the axis is ramping down already."""

    def resume(self, now: float) -> None:
        """Halt is over."""

    @property
    def torque(self) -> float | None:
        """Torque that it applies in [0.1 % of the rated torque]; None when a position is held."""
        return None

    def load_changed(self, now: float) -> None:
        """See another load torque."""

    def setpoint(self, now: float) -> bool:
        """See a target object written; the axis may be at an earlier time.

        Returns:
            The motion has changed.
        """
        return False

    def sync(self, now: float) -> bool:
        """See a SYNC; the axis may be at an earlier time.

        Returns:
            The motion has changed.
        """
        return False

    def event(self, now: float) -> None:
        """Do what is due at :attr:`next_event`."""

    def update(self, now: float) -> None:
        """Look at the axis after it moved."""

    def status(self) -> int:
        """Return bits 10, 12 and 13 of the statusword."""
        return 0


class NoMode(Mode):
    """Mode 0: none is selected, the axis is held."""

    number = OperationMode.NO_MODE


class Dwell:
    """Detects when a condition has held for a time.

    Attributes:
        reached: It has.
        pending: It holds, but not for long enough.
    """

    def __init__(self) -> None:
        self.reached = False
        self.pending = False
        self._since = 0.0

    def clear(self) -> None:
        """Begin again."""
        self.reached = self.pending = False

    def update(self, condition: bool, duration: float, now: float) -> None:
        """Look at the condition.

        Args:
            condition: It is met now.
            duration: How long it has to be met in [s].
            now: Steady time in [s].
        """
        if not condition:
            self.reached = self.pending = False
            return
        if not self.pending and not self.reached:
            self._since = now
        self.reached = self.reached or now - self._since >= duration
        self.pending = not self.reached


TARGET_REACHED = int(Statusword.TARGET_REACHED)
