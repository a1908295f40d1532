# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SDO client: one transfer at a time per device, the others wait in its queue (CiA 301, 7.2.4).

Block transfers are those of 7.2.4.3.8 to 7.2.4.3.17.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from functools import partial
import struct
from typing import Any, NamedTuple, TypeAlias, TypeVar

from canopen_core import SdoAbortError, SdoError, SdoTimeoutError
from canopen_core.can import Frame
from canopen_core.standard import AbortCode, object_address, ObjectDictionary, sdo

from .frame_sender import Send
from .scheduler import Promise, Scheduler, Task
from .sdo_channel import Match, response, SdoChannel, SdoCounters


class SdoClient:
    """Reads and writes objects of one device."""

    def __init__(
        self,
        node_id: int,
        name: str,
        scheduler: Scheduler,
        send: Send,
        *,
        dictionary: ObjectDictionary | None = None,
        on_odd: Callable[[str], None] = lambda text: None,
    ) -> None:
        """Without ``dictionary`` values are not cut to the size of their type.

        For the other arguments see :class:`SdoChannel`.
        """
        self.node_id = node_id  # the device
        # called when the request of a download leaves, with index, sub-index, data and the promise
        # of its end
        self.on_download: list[DownloadHook] = []
        self._name = name
        self._scheduler = scheduler
        self._dictionary = dictionary
        self._channel = SdoChannel(node_id, name, scheduler, send, on_odd)
        self._queue: deque[_Queued] = deque()
        self._urgent: deque[_Queued] = deque()
        self._yields = False  # the running transfer is being ended for an urgent one
        self._made_way = False  # the running transfer has ended for it
        self._busy = False
        self._running: Task[Any] | None = None
        self._has_blocks = True  # until a block transfer fails

    @property
    def counters(self) -> SdoCounters:
        """Results of the transfers."""
        return self._channel.counters

    def read(
        self, index: int, subindex: int, timeout: float, *, block: bool = False
    ) -> Promise[bytes]:
        """Queue the upload of an object.

        Args:
            index: Object index.
            subindex: Sub-index.
            timeout: Longest time for each answer of the device in [s]; the first question is
                repeated within it.
            block: Use a block transfer if the device supports it, for long values.

        Returns:
            Promise of the bytes; rejected with SdoAbortError or SdoTimeoutError.
        """
        upload = partial(self._upload, index, subindex, timeout, block=block)
        promise: Promise[bytes] = Promise()
        self._enqueue(self._queue, _Queued(upload, promise, again=True))
        return promise

    def write(
        self,
        index: int,
        subindex: int,
        data: bytes,
        timeout: float,
        *,
        repeat: bool = False,
        urgent: bool = False,
    ) -> Promise[None]:
        """Queue a download; long values are written in blocks when the device can do that.

        Args:
            index: Object index.
            subindex: Sub-index.
            data: The encoded value.
            timeout: Longest time for each answer of the device in [s].
            repeat: Writing twice is harmless, so a request may be repeated after a loss.
            urgent: Start at once and end the running transfer, unless that is also urgent: an
                upload is restarted afterwards, a download fails. An outstanding answer for the
                object counts as its own.

        Returns:
            Promise of the end; rejected with SdoAbortError or SdoTimeoutError.
        """
        promise: Promise[None] = Promise()

        def leave() -> None:
            for hook in self.on_download:
                hook(index, subindex, data, promise)

        download = partial(
            self._download, index, subindex, data, timeout, leave, repeat=repeat, urgent=urgent
        )
        queue = self._urgent if urgent else self._queue
        self._enqueue(queue, _Queued(download, promise, again=False))
        if urgent and self._yields:
            self._made_way = True
            self._end_running('made way for an urgent SDO')
        return promise

    def cancel_all(self, reason: str) -> None:
        """Reject every transfer that is not urgent, because the device restarted or is lost.

        Urgent ones stop the device, which may still receive frames without answering.
        """
        queue = [*self._queue]
        self._queue.clear()
        if self._yields:
            self._end_running(reason)
        for entry in queue:
            entry.promise.reject(SdoError(f'{self._name}: {reason}'))

    def restarted(self) -> None:
        """Handle a restart of the device: no earlier request is answered any more."""
        self._channel.restarted()

    def receive(self, frame: Frame) -> None:
        """Process an answer of the device."""
        self._channel.receive(frame.data)

    def receive_request(self, _frame: Frame) -> None:
        """Handle a request of another client on this bus to the device."""
        self._channel.note_other_client()

    def _end_running(self, reason: str) -> None:
        """End the running transfer; the next one begins before this returns."""
        if self._running is not None:
            self._channel.cancel()
            self._running.cancel(SdoError(f'{self._name}: {reason}'))

    def _enqueue(self, queue: deque[_Queued], entry: _Queued) -> None:
        queue.append(entry)
        if not self._busy:
            self._scheduler.background(self._work())

    async def _work(self) -> None:
        self._busy = True
        while self._urgent or self._queue:
            self._yields, self._made_way = not self._urgent, False
            entry = (self._urgent or self._queue).popleft()
            try:
                # a task of its own, so that it can be ended wherever it waits
                self._running = self._scheduler.spawn(entry.transfer())
                result = await self._running
            except Exception as error:  # noqa: BLE001  # belongs to the caller
                if self._made_way and entry.again:
                    self._queue.appendleft(entry)
                else:
                    entry.promise.reject(error)
            else:
                self.counters.done += 1
                entry.promise.resolve(result)
        self._busy, self._running, self._yields = False, None, False

    async def _upload(self, index: int, subindex: int, timeout: float, *, block: bool) -> bytes:
        channel = self._channel
        await channel.begin(index, subindex, timeout)
        failure: SdoError | None = None
        if block and self._has_blocks:
            try:
                return await read_blocks(channel, timeout, SIZE_MAX)
            except (SdoAbortError, SdoTimeoutError) as error:
                failure = error
                await channel.begin(index, subindex, timeout)
        request = sdo.UploadRequest(index, subindex).encode()
        match = response(sdo.UploadResponse, channel.address)
        answer = await channel.exchange(request, match, timeout, repeat=True)
        data = (
            await self._upload_segments(answer.size, timeout)
            if answer.data is None
            else self._fitted(answer.data, answer.size)
        )
        self._give_up_blocks(failure)
        return data

    def _fitted(self, data: bytes, size: int | None) -> bytes:
        """Cut the value of an expedited answer to its type; report a size that is too large."""
        address = self._channel.address
        entry = self._dictionary.get(*address) if self._dictionary is not None else None
        if entry is None:
            return data
        value = sdo.fitted(entry.data_type, data)
        if size is not None and len(value) < size:
            self._channel.note_odd(
                'size',
                f'answers SDOs for {object_address(*address)}, {entry.data_type.name} by its EDS, '
                f'with {size} bytes ({data.hex(" ")}); the first {len(value)} count. Where values '
                'are wrong, correct DataType in the EDS',
            )
        return value

    def _give_up_blocks(self, failure: SdoError | None) -> None:
        """Use segments from now on, after they succeeded where a block transfer failed."""
        if failure is not None:
            self._has_blocks = False
            self._channel.note_odd(
                'block', f'has failed at an SDO block transfer, and gets segments now: {failure}'
            )

    async def _upload_segments(self, size: int | None, timeout: float) -> bytes:
        channel, match = self._channel, response(sdo.Segment, self._channel.address)
        limit = UNANNOUNCED_MAX if size is None else size
        if limit > SIZE_MAX:
            raise channel.refuse(AbortCode.OUT_OF_MEMORY, f' ({size} bytes announced)')
        data, toggle, last = bytearray(), False, False
        while not last:
            request = sdo.UploadSegmentRequest(toggle).encode()
            segment = await channel.exchange(request, match, timeout)
            if segment.toggle != toggle:
                raise channel.refuse(AbortCode.TOGGLE_BIT)
            data += segment.data
            toggle, last = not toggle, segment.last
            if len(data) > limit or (size is not None and last and len(data) < size):
                raise channel.refuse(AbortCode.LENGTH, f' ({len(data)} bytes came)')
        return bytes(data)

    async def _download(
        self,
        index: int,
        subindex: int,
        data: bytes,
        timeout: float,
        leave: Callable[[], None],
        *,
        repeat: bool,
        urgent: bool,
    ) -> None:
        channel = self._channel
        await channel.begin(index, subindex, timeout, settle=not urgent)
        leave()
        failure: SdoError | None = None
        if len(data) >= BLOCK_MIN and self._has_blocks:
            try:
                await write_blocks(channel, self._scheduler, data, timeout)
            except (SdoAbortError, SdoTimeoutError) as error:
                failure = error
                await channel.begin(index, subindex, timeout)
            else:
                return
        short = 0 < len(data) <= sdo.EXPEDITED_MAX
        request = sdo.DownloadRequest(index, subindex, data if short else None, len(data))
        match = response(sdo.DownloadResponse, channel.address)
        await channel.exchange(request.encode(), match, timeout, repeat=repeat)
        if not short:
            await self._download_segments(data, timeout)
        self._give_up_blocks(failure)

    async def _download_segments(self, data: bytes, timeout: float) -> None:
        channel, match = (
            self._channel,
            response(sdo.DownloadSegmentResponse, self._channel.address),
        )
        toggle = False
        for start in range(0, max(len(data), 1), sdo.SEGMENT_MAX):
            chunk = data[start : start + sdo.SEGMENT_MAX]
            last = start + sdo.SEGMENT_MAX >= len(data)
            answer = await channel.exchange(
                sdo.Segment(toggle, chunk, last).encode(), match, timeout
            )
            if answer.toggle != toggle:
                raise channel.refuse(AbortCode.TOGGLE_BIT)
            toggle = not toggle


BURST = 8  # segments sent at once
BURST_PAUSE = 0.001  # [s] between two bursts, for the frames of the cycle
FRUITLESS_MAX = 5  # lost blocks before the transfer is given up


async def write_blocks(
    channel: SdoChannel, scheduler: Scheduler, data: bytes, timeout: float
) -> None:
    """Download ``data`` to the object of the current transfer, in blocks.

    Raises:
        SdoAbortError: The device refused, or answered something that makes no sense.
        SdoTimeoutError: It did not answer, and does not have the value.
        SdoError: It did not confirm the end, so it may have the value.
    """
    question = struct.pack(
        '<BHBI', sdo.DOWNLOAD_INITIATE | sdo.CRC_BIT | sdo.SIZE_BIT, *channel.address, len(data)
    )
    answer = await channel.exchange(question, _addressed(channel, sdo.DOWNLOAD_INITIATED), timeout)
    with_crc, segments = bool(answer[0] & sdo.CRC_BIT), answer[4]
    position, fruitless = 0, 0
    while position < len(data):
        if not 1 <= segments <= sdo.BLOCK_SEGMENTS_MAX:
            raise channel.refuse(AbortCode.BLOCK_SIZE)
        frames = sdo.block_frames(data, position, segments)
        for number, frame in enumerate(frames[:-1], start=1):
            await channel.deliver(frame, timeout)
            if number % BURST == 0:
                await scheduler.timer(BURST_PAUSE)
        answer = await channel.exchange(frames[-1], _command(sdo.DOWNLOAD_ACKNOWLEDGED), timeout)
        taken, segments = answer[1], answer[2]
        fruitless = 0 if taken else fruitless + 1
        if taken > len(frames) or fruitless == FRUITLESS_MAX:
            raise channel.refuse(AbortCode.SEQUENCE_NUMBER)
        position += taken * sdo.SEGMENT_BYTES
    end = sdo.end_frame(sdo.DOWNLOAD_END, data, with_crc=with_crc)
    try:
        await channel.exchange(end, _command(sdo.DOWNLOAD_ENDED), timeout)
    except SdoTimeoutError as error:
        raise SdoError(f'{error} after all of it was sent; read it back') from error


async def read_blocks(channel: SdoChannel, timeout: float, size_max: int) -> bytes:
    """Upload the object of the current transfer in blocks.

    Each frame of the device may take the ``timeout`` in [s]; more than ``size_max`` in [byte] is
    refused.

    Raises:
        SdoAbortError: The device refused, or answered something that makes no sense.
        SdoTimeoutError: It did not answer.
    """
    question = struct.pack(
        '<BHBBB2x', sdo.UPLOAD_INITIATE | sdo.CRC_BIT, *channel.address, sdo.BLOCK_SEGMENTS_MAX, 0
    )
    answer = await channel.exchange(question, _addressed(channel, sdo.UPLOAD_INITIATED), timeout)
    with_crc = bool(answer[0] & sdo.CRC_BIT)
    announced = int.from_bytes(answer[4:], 'little') if answer[0] & sdo.SIZE_BIT else None
    limit = size_max if announced is None else min(announced, size_max)
    data, question, finished = bytearray(), _client_frame(sdo.START_UPLOAD), False
    while not finished:
        taken, finished = await _read_block(channel, question, data, timeout)
        if len(data) >= limit + sdo.SEGMENT_BYTES:
            raise channel.refuse(AbortCode.LENGTH_HIGH, f' (more than {limit} bytes)')
        question = _client_frame(sdo.ACKNOWLEDGE_UPLOAD, taken, sdo.BLOCK_SEGMENTS_MAX)
    end = await channel.exchange(question, _command(sdo.UPLOAD_END, mask=0xE3), timeout)
    unused, (crc,) = end[0] >> 2 & 0x07, struct.unpack_from('<H', end, 1)
    del data[len(data) - unused :]
    if with_crc and crc != sdo.checksum(bytes(data)):
        raise channel.refuse(AbortCode.CRC)
    if announced is not None and len(data) != announced:
        raise channel.refuse(AbortCode.LENGTH)
    await channel.deliver(_client_frame(sdo.END_UPLOAD), timeout)
    return bytes(data)


async def _read_block(
    channel: SdoChannel, question: bytes | None, data: bytearray, timeout: float
) -> tuple[int, bool]:
    """Collect one block; return how many segments came in order, and whether all is there."""
    taken = 0
    while True:
        frame = await channel.exchange(question, _segment, timeout)
        question = None
        number, last = frame[0] & ~sdo.LAST, bool(frame[0] & sdo.LAST)
        in_order = number == taken + 1
        if in_order:
            taken = number
            data += frame[1:]
        if last or number >= sdo.BLOCK_SEGMENTS_MAX:
            return taken, last and in_order


def _client_frame(subcommand: int, *content: int) -> bytes:
    return bytes((sdo.UPLOAD_INITIATE | subcommand, *content)).ljust(8, b'\0')


def _segment(data: bytes) -> bytes | None:
    return data if len(data) == 8 and data[0] & ~sdo.LAST else None


def _command(command: int, *, mask: int = 0xFF) -> Match[bytes]:
    return lambda data: data if len(data) == 8 and data[0] & mask == command else None


def _addressed(channel: SdoChannel, command: int) -> Match[bytes]:
    """Return a matcher for the response to an initiate request."""

    def match(data: bytes) -> bytes | None:
        if len(data) != 8 or data[0] & ~(sdo.CRC_BIT | sdo.SIZE_BIT) != command:
            return None
        return data if struct.unpack_from('<xHB', data) == channel.address else None

    return match


T = TypeVar('T')
Transfer: TypeAlias = Callable[[], Coroutine[Promise[Any], None, T]]
DownloadHook: TypeAlias = Callable[[int, int, bytes, Promise[None]], None]

BLOCK_MIN = 256  # [byte] smallest value that is written in blocks
SIZE_MAX = 16 << 20  # [byte] that a device may announce
UNANNOUNCED_MAX = 1 << 20  # [byte] that it may send without having announced a length


class _Queued(NamedTuple):
    """A queued transfer, the promise of its end, and whether it may be restarted."""

    transfer: Transfer[Any]
    promise: Promise[Any]
    again: bool
