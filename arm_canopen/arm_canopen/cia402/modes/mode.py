# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What an operation mode is to the master (CiA 402-2, clauses 10 to 16).

A mode writes its target object and returns its bits of the controlword. Every mode is
preloaded with the actual value before the drive is enabled or the mode switched, so that nothing
moves before a command.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable

from canopen_core import DriveError
from canopen_core.standard import OperationMode, Statusword

from ...master.process_image import Writer
from ...master.scheduler import completed, Promise
from ..state import Actual

TARGET_REACHED = int(Statusword.TARGET_REACHED)
NO_BITS = 0  # bits are plain numbers in the cycle, where operators of IntFlag cost too much


class OffsetTarget:
    """A target object that is written less its offset, so that the drive does what is commanded.

    The offset counts as it is when a target is preloaded: one that is written while the drive is
    enabled moves the axis by itself, as whoever writes it intends.
    """

    def __init__(self, target: Writer, offset: Callable[[], int]) -> None:
        """``offset`` returns what the offset object holds in device units."""
        self.by_sdo = target.by_sdo
        self._target = target
        self._read = offset
        self._offset = 0

    @property
    def limits(self) -> tuple[float, float]:
        """Smallest and largest sum of target and offset."""
        low, high = self._target.limits
        return low + self._offset, high + self._offset

    def write(self, value: float) -> None:
        """Command a value in device units."""
        self._target.write(value - self._offset)

    def deliver(self, value: float) -> Promise[None]:
        """Command the value that holds the drive, with the offset that it has now."""
        self._offset = self._read()
        return self._target.deliver(value - self._offset)


class Mode(ABC):
    """One operation mode of one drive.

    Attributes:
        number: Its value in 0x6060.
        halts_by_bit: Bit 8 of the controlword stops it; else the master brakes its set-points.
        cyclic: Its target acts on the drive in each cycle.
        by_sdo: Its target goes by SDO, because no RPDO carries it.
        setpoint: Position commanded last in user units, None in a mode that commands none.
    """

    number: OperationMode
    halts_by_bit = True
    cyclic = False
    by_sdo = False
    setpoint: float | None = None

    @abstractmethod
    def preload(self, actual: Actual) -> Promise[None]:
        """Forget any target and command what holds the drive where it is.

        Returns:
            Done when the drive has it; whatever stood in its target object before acts no more.
        """

    @abstractmethod
    def set_target(self, target: float) -> Promise[None]:
        """Accept a single target in user units.

        Returns:
            Done when the drive has it; rejected when it has refused it, or was stopped before.

        Raises:
            DriveError: The mode has no target, or the value does not fit.
        """

    def follow_target(self, target: float) -> Promise[None]:
        """Accept one of a stream of targets; :meth:`set_target` where the drive itself leads."""
        return self.set_target(target)

    @abstractmethod
    def step(self, now: float, period: float, statusword: int) -> int:
        """Advance a cycle in which the drive accepts targets; return the bits of this mode."""

    def brake(self) -> None:  # noqa: B027  # most modes leave it to the drive
        """Come to rest by own means, for a halt, a switch or the end of a stream."""

    @property
    def braked(self) -> bool:
        """Whether what the mode commands stands still, as far as the mode itself leads it."""
        return True

    def reached(self, statusword: int) -> bool:
        """Whether the drive is where the last target is, as far as the mode knows."""
        return bool(statusword & TARGET_REACHED)

    @property
    def taken(self) -> bool:
        """Whether the drive has a target that was commanded after the last brake."""
        return True


class NoMode(Mode):
    """Mode 0: nothing is commanded."""

    number = OperationMode.NO_MODE

    def preload(self, actual: Actual) -> Promise[None]:
        """Preload nothing."""
        return completed()

    def set_target(self, target: float) -> Promise[None]:
        """Refuse every target."""
        raise DriveError('no mode of operation is selected; select position_mode or another first')

    def step(self, now: float, period: float, statusword: int) -> int:
        """Command nothing."""
        return NO_BITS
