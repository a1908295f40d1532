# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Objects that no PDO carries: polled, or written when they change, by SDO outside the cycle."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..exceptions import CodecError, SdoAbortError, SdoError, SdoTimeoutError
from ..standard.pdo import Number
from .events import EventKind, Severity
from .process_image import Limits, Source
from .scheduler import Promise, Scheduler

if TYPE_CHECKING:
    from .remote_objects import RemoteObjects

WRITE_PAUSE = 0.05  # [s] between two writes of a value of which the newest counts


class BackgroundReader:
    """An object that no TPDO carries; it is polled by SDO.

    Attributes:
        value: The value, None while unknown.
        timestamp: Steady time of its last answer in [s].
    """

    def __init__(self, stale_after: float) -> None:
        """Start unknown.

        Args:
            stale_after: Age in [s] from which the value is too old to act on.
        """
        self.value: Number | None = None
        self.timestamp = 0.0
        self._stale_after = stale_after

    @property
    def source(self) -> Source:
        """Itself: it is polled alone."""
        return self

    def stale(self, now: float) -> bool:
        """Tell whether it is unknown, or too old to act on, at a steady time in [s]."""
        return self.value is None or now - self.timestamp > self._stale_after


class BackgroundWriter:
    """An object that no RPDO carries; it is written by SDO when it changes."""

    def __init__(self, node: RemoteObjects, index: int, subindex: int) -> None:
        """Remember nothing written yet."""
        self._node = node
        self._address = (index, subindex)
        self._written: Number | None = None
        self._failing = False
        self._open = 0

    @property
    def limits(self) -> Limits:
        """Smallest and largest value that the object holds, by its type in the EDS."""
        return self._node.limits(*self._address)

    @property
    def delivered(self) -> bool:
        """Whether the device has confirmed the last value."""
        return not self._open and not self._failing

    def write(self, value: Number) -> None:
        """Queue the write unless this is the value that was written last."""
        if value == self._written or not self._node.online:
            return
        self._written = value
        self._open += 1
        self._node.write_object(*self._address, value).when_done(self._check)

    def forget(self) -> None:
        """The device restarted: write again whatever comes."""
        self._written = None
        self._failing = False

    def _check(self, promise: Promise[None]) -> None:
        self._open -= 1
        failing, self._failing = self._failing, promise.error is not None
        if promise.error is None or not self._node.online:
            return
        if not isinstance(promise.error, SdoAbortError):
            self._written = None  # it did not arrive; a value that was refused is not repeated
        if not failing:
            self._node.report(EventKind.PDO, Severity.WARNING, str(promise.error))


class LatestWriter:
    """An object that is written by SDO, of which only the newest value counts.

    One transfer is on its way at a time, and there is a pause between two, so that a value that
    changes all the time does not fill the bus.
    """

    def __init__(
        self, node: RemoteObjects, scheduler: Scheduler, index: int, subindex: int
    ) -> None:
        """Remember nothing written yet."""
        self._node = node
        self._scheduler = scheduler
        self._address = (index, subindex)
        self._wanted: Number | None = None
        self._held: Number | None = None
        self._busy = False
        self._failing = False

    @property
    def limits(self) -> Limits:
        """Smallest and largest value that the object holds, by its type in the EDS."""
        return self._node.limits(*self._address)

    @property
    def delivered(self) -> bool:
        """Whether the device has confirmed the last value."""
        return self._wanted == self._held

    def write(self, value: Number) -> None:
        """Have the device hold a value as soon as possible."""
        self._wanted = value
        if value != self._held and not self._busy and self._node.online:
            self._scheduler.background(self._deliver())

    def forget(self) -> None:
        """The device restarted: write again whatever comes."""
        self._wanted = self._held = None

    async def _deliver(self) -> None:
        self._busy = True
        try:
            while self._wanted is not None and self._wanted != self._held and self._node.online:
                value = self._wanted
                try:
                    await self._node.write_object(*self._address, value)
                except (SdoError, CodecError) as error:
                    self._failed(error)
                    if not isinstance(error, SdoTimeoutError):
                        break  # what was refused is not repeated before somebody asks again
                else:
                    self._held, self._failing = value, False
                await self._scheduler.timer(WRITE_PAUSE)
        finally:
            self._busy = False

    def _failed(self, error: Exception) -> None:
        if not self._failing and self._node.online:
            self._node.report(EventKind.PDO, Severity.WARNING, str(error))
        self._failing = True
