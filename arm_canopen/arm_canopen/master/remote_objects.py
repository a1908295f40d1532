# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The objects of a device: by PDO where one carries them, else by SDO, typed by its EDS."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from functools import partial
import math
from typing import NamedTuple, TypeAlias

from canopen_core import CodecError, DriveError, SdoError, SdoTimeoutError
from canopen_core.can import Frame
from canopen_core.standard import (
    DataType,
    decode,
    DIGITAL_INPUTS,
    encode,
    find_object,
    integer_range,
    is_controlword,
    MappedObject,
    Number,
    object_address,
    ObjectEntry,
    PdoCodec,
    Value,
)

from ..config.model import NodeConfig
from ..config.model.bus import PERIODS_MISSED, STALE_AFTER
from .events import EventKind, Severity
from .frame_sender import Send
from .process_image import InputReader, Limits, limits_of, ProcessImage, SyncRound, Writer
from .scheduler import Promise, Scheduler
from .sdo_client import SdoClient

INPUTS_TIME = 0.5  # [s] after the start in which a device sends its inputs, if it does
WRITE_PAUSE = 0.05  # [s] between two writes of a changing value
REFUSED_PAUSE = 1.0  # [s] before a refused value is written again, doubled each time
DOUBLED_MAX = 5  # how often this pause is doubled
REAL32_MAX = (2.0 - 2.0**-23) * 2.0**127

ReportOfDevice = Callable[[EventKind, Severity, str], None]


def start_value(config: NodeConfig, mapped: MappedObject) -> Number:
    """Return the value of an object after the boot of its device, by the files.

    An object without commands (a torque limit, a profile velocity, digital outputs) must keep
    what bus.yml wrote or else what its EDS has as default.

    Returns:
        The value; 0 if neither defines one that fits the object.
    """
    value = config.value_after_boot(mapped.index, mapped.subindex, mapped.data_type)
    if isinstance(value, (int, float)):
        try:
            PdoCodec([mapped]).pack([value])
        except CodecError:
            return 0
        return value
    return 0


class BackgroundReader:
    """Polls an object that no TPDO carries by SDO."""

    count = 0  # number of TPDOs with the object

    def __init__(self, stale_after: float) -> None:
        self.value: Number | None = None  # the value, None while unknown
        self.timestamp = 0.0  # steady time of the last answer in [s]
        self.stale_after = stale_after  # age in [s] from which the value is too old to act on

    @property
    def source(self) -> BackgroundReader:
        """The reader itself, as it is polled alone."""
        return self

    def stale(self, now: float) -> bool:
        """Return whether it is unknown, or too old to act on, at a steady time in [s]."""
        return self.value is None or now - self.timestamp > self.stale_after


class QueuedWrite(NamedTuple):
    """A value queued for its transfer."""

    value: Number  # the value
    written: Promise[None]  # done when the device has it
    # time in [s] in which no other one follows, so that a value that changes all the time does not
    # fill the bus
    pause: float = 0.0


class SdoWriter:
    """Writes an object that no RPDO carries by SDO, one value at a time and in order."""

    by_sdo = True  # it goes by SDO

    def __init__(
        self, objects: RemoteObjects, scheduler: Scheduler, index: int, subindex: int
    ) -> None:
        self._objects = objects
        self._scheduler = scheduler
        self._address = (index, subindex)
        self._queue: deque[QueuedWrite] = deque()
        self._busy = False
        self._last: Number | None = None  # last requested value
        self._failed = False  # the transfer of that value failed
        self._failures = 0  # consecutive failures
        self._write_again_at = 0.0

    @property
    def limits(self) -> Limits:
        """Smallest and largest value of the object, by its type in the EDS."""
        return self._objects.limits(*self._address)

    def write(self, value: Number) -> None:
        """Keep a value in the device, called each cycle; each change is sent.

        A lost value is sent again at once, a refused one at increasing intervals.
        """
        if value == self._last and not self._is_due():
            return
        if self._objects.online:
            self._enqueue(QueuedWrite(value, Promise()))

    def deliver(self, value: Number) -> Promise[None]:
        """Send a value once, even if unchanged; a newer value replaces one still waiting.

        Returns:
            Done when the device has this value or a newer one; rejected with what the device, or
            the silence, says.
        """
        written = self._queue.pop().written if self._queue else Promise()
        self._enqueue(QueuedWrite(value, written, WRITE_PAUSE))
        return written

    def forget(self) -> None:
        """Forget the last value, because the device restarted, so the next one is written."""
        while self._queue:
            self._queue.popleft().written.reject(self._offline())
        self._last = None
        self._failed = False
        self._failures = 0

    def _is_due(self) -> bool:
        """Whether the last value is due to be sent again."""
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
        """Report the first failure, and keep values from queueing up behind further ones."""
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


Reader: TypeAlias = InputReader | BackgroundReader
"""Last known value of an object of the device, and what it comes in, which knows its age."""


class RemoteObjects:
    """The objects of a device, accessed by PDO or SDO."""

    def __init__(
        self,
        config: NodeConfig,
        scheduler: Scheduler,
        sync: SyncRound,
        send: Send,
        *,
        report: ReportOfDevice,
        is_online: Callable[[], bool],
    ) -> None:
        self.config = config  # its configuration, from bus.yml and its EDS
        self.name = config.name  # name in bus.yml
        # its process image
        self.image = ProcessImage(
            config.tpdos,
            config.rpdos,
            sync,
            start=partial(start_value, config),
            cyclic=config.is_drive,
            send_last=is_controlword,
        )
        # its SDO client
        self.sdo = SdoClient(
            config.node_id,
            config.name,
            scheduler,
            send,
            dictionary=config.dictionary,
            on_odd=partial(report, EventKind.SDO, Severity.WARNING),
        )
        self.sdo.on_download.append(self._object_downloaded)
        self.report = report  # reports errors of an object
        self._is_online = is_online
        self._scheduler = scheduler
        self._polled: dict[tuple[int, int], BackgroundReader] = {}
        self._sdo_writers: list[SdoWriter] = []

    @property
    def online(self) -> bool:
        """Whether the device was booted, and not lost since."""
        return self._is_online()

    def reader(self, index: int, subindex: int = 0) -> Reader:
        """Return a reader for an object: by TPDO if mapped, else by SDO polling."""
        mapped = self.image.reader(index, subindex)
        if mapped is not None:
            return mapped
        polled = PERIODS_MISSED * (self.config.poll_period + self.config.sdo_timeout)
        reader = BackgroundReader(max(STALE_AFTER, polled))
        return self._polled.setdefault((index, subindex), reader)

    def writer(self, index: int, subindex: int = 0) -> Writer:
        """Return a writer for an object: by RPDO if mapped, else by SDO."""
        mapped = self.image.writer(index, subindex)
        if mapped is not None:
            return mapped
        writer = SdoWriter(self, self._scheduler, index, subindex)
        self._sdo_writers.append(writer)
        return writer

    async def poll(self, period: float) -> None:
        """Poll the objects that no TPDO carries every ``period`` in [s] while online."""
        while self._polled and self.online:
            for address, entry in list(self._polled.items()):
                try:
                    value = await self.read_object(*address)
                except (SdoError, CodecError):
                    if not self.online:
                        return
                    continue  # the SDO counters show it; the value keeps its age
                entry.value = value if isinstance(value, (int, float)) else None
                entry.timestamp = self._scheduler.now
            await self._scheduler.timer(period)

    def note_value(self, index: int, subindex: int, data: bytes) -> None:
        """Store a value that was read elsewhere, if the object is polled."""
        entry = self._polled.get((index, subindex))
        listed = self.config.dictionary.get(index, subindex)
        if entry is None or listed is None:
            return
        try:
            value = decode(listed.data_type, data)
        except CodecError:
            return
        entry.value = value if isinstance(value, (int, float)) else None
        entry.timestamp = self._scheduler.now

    def entry(self, index: int, subindex: int = 0) -> ObjectEntry:
        """Return the entry of an object in the EDS."""
        entry = self.config.dictionary.get(index, subindex)
        if entry is None:
            raise SdoError(
                f'{self.name} has no object {object_address(index, subindex)} in '
                f'{self.config.eds.name}; add it to the EDS, or access it by a request that names '
                'the data type'
            )
        return entry

    def check_owner(self, index: int) -> None:
        """Refuse to write an object that the driver of this device writes."""
        if index in self.config.commanded_indices:
            raise DriveError(
                f'{object_address(index)} of {self.name} is written by its driver in each cycle; '
                'use the commands of the drive'
            )

    def limits(self, index: int, subindex: int = 0) -> Limits:
        """Return the smallest and largest value of an object, by its type in the EDS."""
        entry = self.config.dictionary.get(index, subindex)
        return (-math.inf, math.inf) if entry is None else limits_of(entry.data_type)

    async def read_digital_inputs(self) -> None:
        """Read digital inputs by SDO if their TPDO is sent only on change (CiA 401)."""
        await self._scheduler.timer(INPUTS_TIME)
        for entry in self.image.tpdos:
            mapping = entry.config.mapping
            on_change = entry.values is None and entry.stale_after == math.inf
            if not on_change or any(m.index not in DIGITAL_INPUTS.indices for m in mapping):
                continue
            with suppress(SdoError, CodecError):
                read = [await self.read_object(each.index, each.subindex) for each in mapping]
                data = entry.codec.pack([each for each in read if isinstance(each, (int, float))])
                if entry.values is None and self.online:
                    entry.receive(Frame(entry.config.cob_id, data, self._scheduler.now))

    async def read_object(
        self, index: int, subindex: int = 0, *, timeout: float | None = None
    ) -> Value:
        """Read an object by SDO and decode it by its type in the EDS.

        Each answer may take the ``timeout`` in [s], by default that of bus.yml.

        Raises:
            SdoError: The device did not answer or aborted, or the object is not in the EDS.
            CodecError: The answer does not fit the type.
        """
        entry = self.entry(index, subindex)
        limit = self.config.sdo_timeout if timeout is None else timeout
        return decode(entry.data_type, await self.sdo.read(index, subindex, limit))

    def write_object(
        self, index: int, subindex: int, value: Value, *, urgent: bool = False
    ) -> Promise[None]:
        """Write an object by SDO, encoded by its type in the EDS; errors reject the promise.

        An urgent write does not wait for other SDOs, see :meth:`SdoClient.write`.
        """
        try:
            data = encode(self.entry(index, subindex).data_type, value)
        except (SdoError, CodecError) as error:
            refused: Promise[None] = Promise()
            refused.reject(error)
            return refused
        timeout = self.config.write_timeout(index, subindex)
        return self.sdo.write(index, subindex, data, timeout, urgent=urgent)

    def _object_downloaded(
        self, index: int, subindex: int, data: bytes, end: Promise[None]
    ) -> None:
        """Update RPDOs that carry an object an SDO is about to write, so as not to revert it.

        The device may take the value long before its answer arrives.
        """
        mapped = self.image.mapped_output(index, subindex)
        if mapped is None or index in self.config.commanded_indices:
            return
        try:
            value = decode(mapped.data_type, data)
        except CodecError:
            return
        before = self.image.commanded(index, subindex)
        if before is None or not isinstance(value, (int, float)):
            return
        self.image.store(index, subindex, value)

        def set_back(end: Promise[None]) -> None:
            unchanged = self.image.commanded(index, subindex) == value  # by a later write
            if end.error is not None and unchanged:
                self.image.store(index, subindex, before)

        end.when_done(set_back)

    def check_output(self, index: int, subindex: int, value: Value) -> Number:
        """Return a value checked for an RPDO, as a device does not report one out of range.

        Raises:
            CodecError: It is not a number, or beyond the type or the limits of the EDS.
        """
        mapped = self.image.mapped_output(index, subindex)
        data_type = self.entry(index, subindex).data_type if mapped is None else mapped.data_type
        low, high = limits_of(data_type)
        if data_type is DataType.REAL32:
            low, high = -REAL32_MAX, REAL32_MAX
        entry = self.config.dictionary.get(index, subindex)
        if entry is not None:
            low = low if entry.low_limit is None else max(low, entry.low_limit)
            high = high if entry.high_limit is None else min(high, entry.high_limit)
        whole = integer_range(data_type) is not None
        if (
            not isinstance(value, (int, float))
            or not math.isfinite(value)
            or not low <= value <= high
            or (whole and value != int(value))
        ):
            raise CodecError(
                f'{object_address(index, subindex)} of {self.name} cannot hold {value!r} '
                f'({data_type.name}: {low:g} to {high:g})'
            )
        return int(value) if whole else float(value)

    async def upload(self, path: str, timeout: float | None = None) -> tuple[ObjectEntry, bytes]:
        """Read an object by its name or number, see :func:`.find_object`.

        Each answer may take the ``timeout`` in [s], by default that of bus.yml.

        Raises:
            ObjectError: The EDS has no such object.
            SdoError: The device refused or did not answer.
        """
        entry = find_object(self.config.dictionary, path)
        block = entry.data_type is DataType.DOMAIN
        limit = self.config.sdo_timeout if timeout is None else timeout
        return entry, await self.sdo.read(*entry.address, limit, block=block)

    async def download(
        self,
        path: str,
        to_bytes: Callable[[ObjectEntry], bytes],
        timeout: float | None = None,
    ) -> tuple[ObjectEntry, bytes]:
        """Write an object by its name or number.

        ``to_bytes`` encodes the value for its entry. Each answer may take the ``timeout`` in [s],
        by default what bus.yml allows this object.

        Raises:
            ObjectError: The EDS has no such object.
            CodecError: The value does not fit the type.
            DriveError: The master writes the object itself in each cycle.
            SdoError: The device refused or did not answer.
        """
        entry = find_object(self.config.dictionary, path)
        self.check_owner(entry.index)
        data = to_bytes(entry)
        limit = self.config.write_timeout(*entry.address) if timeout is None else timeout
        await self.sdo.write(*entry.address, data, limit)
        return entry, data

    def forget(self, reason: str) -> None:
        """Forget values sent or received, because the device restarted or is lost."""
        self.image.clear()
        self.sdo.cancel_all(reason)
        for entry in self._polled.values():
            entry.value = None
        for writer in self._sdo_writers:
            writer.forget()
