# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Objects that no PDO carries: polled, or written by SDO outside the cycle."""

from __future__ import annotations

from collections import deque
from typing import NamedTuple, TYPE_CHECKING

from ..exceptions import CodecError, SdoError, SdoTimeoutError
from ..standard.pdo import Number
from .events import EventKind, Severity
from .process_image import Limits, Source
from .scheduler import Promise, Scheduler

if TYPE_CHECKING:
    from .remote_objects import RemoteObjects

WRITE_PAUSE = 0.05  # [s] between two writes of a value of which the newest counts
REFUSED_PAUSE = 1.0  # [s] before a value that was refused is written again, doubled each time
DOUBLED_MAX = 5  # times


class BackgroundReader:
    """An object that no TPDO carries; it is polled by SDO."""

    def __init__(self, stale_after: float) -> None:
        self.value: Number | None = None  # the value, None while unknown
        self.timestamp = 0.0  # steady time of its last answer in [s]
        self.stale_after = stale_after  # age in [s] from which the value is too old to act on

    @property
    def source(self) -> Source:
        """Itself: it is polled alone."""
        return self

    def stale(self, now: float) -> bool:
        """Return whether it is unknown, or too old to act on, at a steady time in [s]."""
        return self.value is None or now - self.timestamp > self.stale_after


class QueuedWrite(NamedTuple):
    """A value that waits for its transfer."""

    value: Number  # the value
    written: Promise[None]  # done when the device has it
    # time in [s] in which no other one follows, so that a value that changes all the time does not
    # fill the bus
    pause: float = 0.0


class SdoWriter:
    """An object that no RPDO carries: its values go by SDO, one at a time and in their order.

    Attributes:
        by_sdo: It goes by SDO.
    """

    by_sdo = True

    def __init__(
        self, objects: RemoteObjects, scheduler: Scheduler, index: int, subindex: int
    ) -> None:
        self._objects = objects
        self._scheduler = scheduler
        self._address = (index, subindex)
        self._queue: deque[QueuedWrite] = deque()
        self._busy = False
        self._last: Number | None = None  # that was requested
        self._failed = False  # its transfer
        self._failures = 0  # in a row
        self._write_again_at = 0.0

    @property
    def limits(self) -> Limits:
        """Smallest and largest value that the object holds, by its type in the EDS."""
        return self._objects.limits(*self._address)

    def write(self, value: Number) -> None:
        """Have the device hold a value, cycle by cycle; each change of it is sent.

        What was lost is sent again at once, and what was refused ever less often.
        """
        if value == self._last and not self._is_due():
            return
        if self._objects.online:
            self._enqueue(QueuedWrite(value, Promise()))

    def deliver(self, value: Number) -> Promise[None]:
        """Send a value once, whatever the device has; of those that wait the newest counts.

        Returns:
            Done when the device has this value or a newer one; rejected with what the device, or
            the silence, says.
        """
        written = self._queue.pop().written if self._queue else Promise()
        self._enqueue(QueuedWrite(value, written, WRITE_PAUSE))
        return written

    def forget(self) -> None:
        """The device restarted: write again whatever comes."""
        while self._queue:
            self._queue.popleft().written.reject(self._offline())
        self._last = None
        self._failed = False
        self._failures = 0

    def _is_due(self) -> bool:
        """Whether the last value is to be sent again."""
        return self._failed and not self._busy and self._scheduler.now >= self._write_again_at

    def _enqueue(self, entry: QueuedWrite) -> None:
        self._last, self._failed = entry.value, False
        self._queue.append(entry)
        if not self._busy:
            self._scheduler.background(self._work())

    async def _work(self) -> None:
        self._busy = True
        try:
            while self._queue:
                value, written, pause = self._queue.popleft()
                try:
                    await self._transfer(value)
                except (SdoError, CodecError) as error:
                    self._note_failure(error, repeats=not pause)
                    written.reject(error)
                else:
                    self._failures = 0
                    written.resolve(None)
                if pause:
                    await self._scheduler.timer(pause)
        finally:
            self._busy = False

    async def _transfer(self, value: Number) -> None:
        if not self._objects.online:
            raise self._offline()
        await self._objects.write_object(*self._address, value)

    def _note_failure(self, error: Exception, *, repeats: bool) -> None:
        """Report the first failure, and keep values from piling up behind those that follow."""
        while len(self._queue) > 1:
            self._queue.popleft().written.follow(self._queue[-1].written)
        self._failed = not self._queue
        if not self._objects.online:
            return
        lost = isinstance(error, SdoTimeoutError)  # the time-out was pause enough
        pause = 0.0 if lost else REFUSED_PAUSE * 2**self._failures
        if not self._failures:
            hint = (
                f'; it is sent again in {pause:g} s, then ever less often'
                if repeats and pause
                else ''
            )
            self._objects.report(EventKind.PDO, Severity.WARNING, f'{error}{hint}')
        self._write_again_at = self._scheduler.now + pause
        self._failures = min(self._failures + 1, DOUBLED_MAX)

    def _offline(self) -> SdoError:
        return SdoError(f'{self._objects.name} is offline')
