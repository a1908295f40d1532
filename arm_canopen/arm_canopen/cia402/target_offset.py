# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Offsets that a drive adds to the targets of its cyclic modes (CiA 402-2, clauses 13 to 15)."""

from __future__ import annotations

from collections.abc import Callable

from canopen_core.standard import Index, OperationMode

from ..master.process_image import Writer
from ..master.scheduler import Promise

OFFSET_OBJECTS: dict[OperationMode, Index] = {
    OperationMode.CYCLIC_POSITION: Index.POSITION_OFFSET,
    OperationMode.CYCLIC_VELOCITY: Index.VELOCITY_OFFSET,
    OperationMode.CYCLIC_TORQUE: Index.TORQUE_OFFSET,
}
"""What a drive adds to the target of a mode."""


class OffsetTarget:
    """A target object that is written less its offset, so that the drive does what is commanded.

    The offset counts as it is when a target is preloaded: one that is written while the drive is
    enabled moves the axis by itself, as whoever writes it intends.
    """

    def __init__(self, target: Writer, offset: Callable[[], int]) -> None:
        """``offset`` returns what the offset object holds in device units."""
        self._target = target
        self._read = offset
        self._offset = 0

    @property
    def by_sdo(self) -> bool:
        """Whether the target goes by SDO, because no RPDO carries it."""
        return self._target.by_sdo

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
