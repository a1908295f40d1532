# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SDO client: one transfer at a time per device, the others wait in its queue (CiA 301, 7.2.4)."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Coroutine
from dataclasses import dataclass
from typing import Any, TypeVar

from ..can.frame import Frame
from ..exceptions import CodecError, SdoAbortError, SdoError, SdoTimeoutError
from ..standard.cob_id import CobId
from ..standard.sdo import (
    Abort,
    decode_response,
    DownloadRequest,
    DownloadResponse,
    DownloadSegmentResponse,
    EXPEDITED_MAX,
    Request,
    Response,
    Segment,
    SEGMENT_MAX,
    UploadRequest,
    UploadResponse,
    UploadSegmentRequest,
)
from ..standard.sdo_abort import abort_text, AbortCode
from .scheduler import Promise, Scheduler

T = TypeVar('T')
Answer = TypeVar('Answer', UploadResponse, Segment, DownloadResponse, DownloadSegmentResponse)
Transfer = Coroutine[Promise[Any], None, Any]


@dataclass(slots=True)
class SdoCounters:
    """What became of the transfers to one device."""

    done: int = 0
    aborted: int = 0
    timed_out: int = 0
    stale: int = 0  # answers that belong to no open request


class SdoClient:
    """Reads and writes objects of one device.

    Attributes:
        node_id: The device.
        counters: What became of its transfers.
    """

    def __init__(
        self, node_id: int, name: str, scheduler: Scheduler, send: Callable[[Frame], None]
    ) -> None:
        """Take the way to the bus.

        Args:
            node_id: The device.
            name: Its name, for messages.
            scheduler: Time.
            send: Hands a frame to the bus.
        """
        self.node_id = node_id
        self.counters = SdoCounters()
        self._name = name
        self._scheduler = scheduler
        self._send = send
        self._queue: deque[tuple[Transfer, Promise[Any]]] = deque()
        self._busy = False
        self._expected: Promise[Response] | None = None
        self._answer: type[Response] = Abort
        self._address = (0, 0)
        self._strays = 0  # frames since the open request that do not answer it

    def read(self, index: int, subindex: int, timeout: float) -> Promise[bytes]:
        """Queue an upload.

        Args:
            index: Object index.
            subindex: Sub-index.
            timeout: Longest time for each answer of the device in [s].

        Returns:
            Promise of the bytes; rejected with SdoAbortError or SdoTimeoutError.
        """
        return self._enqueue(self._upload(index, subindex, timeout))

    def write(self, index: int, subindex: int, data: bytes, timeout: float) -> Promise[None]:
        """Queue a download; arguments and errors as with :meth:`read`."""
        return self._enqueue(self._download(index, subindex, data, timeout))

    def cancel_all(self, reason: str) -> None:
        """Reject every transfer, because the device restarted or went away."""
        queue, self._queue = self._queue, deque()
        expected, self._expected = self._expected, None
        if expected is not None:
            expected.reject(SdoError(f'{self._name}: {reason}'))
        for coroutine, promise in queue:
            coroutine.close()
            promise.reject(SdoError(f'{self._name}: {reason}'))

    def receive(self, frame: Frame) -> None:
        """Take an answer of the device.

        What does not answer the open request is passed over: it is the late answer to one that
        timed out, or meant for another client.
        """
        response = self._decode(frame.data)
        if self._expected is None or response is None or not self._fits(response):
            self.counters.stale += 1
            self._strays += 1
            return
        expected, self._expected = self._expected, None
        expected.resolve(response)

    @staticmethod
    def _decode(data: bytes) -> Response | None:
        try:
            return decode_response(data)
        except CodecError:
            return None

    def _fits(self, response: Response) -> bool:
        """Whether a response answers the open request."""
        if isinstance(response, Abort):
            # python-canopen's peers send aborts with index 0, so such an abort counts for any
            return (response.index, response.subindex) in (self._address, (0, 0))
        if not isinstance(response, self._answer):
            return False
        if isinstance(response, (UploadResponse, DownloadResponse)):
            return (response.index, response.subindex) == self._address
        return True

    def _enqueue(self, transfer: Coroutine[Promise[Any], None, T]) -> Promise[T]:
        promise: Promise[T] = Promise()
        self._queue.append((transfer, promise))
        if not self._busy:
            self._scheduler.background(self._work())
        return promise

    async def _work(self) -> None:
        self._busy = True
        while self._queue:
            transfer, promise = self._queue.popleft()
            try:
                result = await transfer
            except Exception as error:  # noqa: BLE001  # belongs to whoever asked
                promise.reject(error)
            else:
                self.counters.done += 1
                promise.resolve(result)
        self._busy = False

    async def _upload(self, index: int, subindex: int, timeout: float) -> bytes:
        self._address = (index, subindex)
        request = UploadRequest(index, subindex)
        response = await self._exchange(request, UploadResponse, timeout)
        if response.data is not None:
            return response.data
        return await self._upload_segments(response.size, timeout)

    async def _upload_segments(self, size: int | None, timeout: float) -> bytes:
        data, toggle, last = bytearray(), False, False
        while not last:
            segment = await self._exchange(UploadSegmentRequest(toggle), Segment, timeout)
            if segment.toggle != toggle:
                raise self._abort(AbortCode.TOGGLE_BIT)
            data += segment.data
            toggle, last = not toggle, segment.last
            if size is not None and (len(data) > size or (last and len(data) < size)):
                raise self._abort(AbortCode.LENGTH)
        return bytes(data)

    async def _download(self, index: int, subindex: int, data: bytes, timeout: float) -> None:
        self._address = (index, subindex)
        short = 0 < len(data) <= EXPEDITED_MAX
        request = DownloadRequest(index, subindex, data if short else None, len(data))
        await self._exchange(request, DownloadResponse, timeout)
        if not short:
            await self._download_segments(data, timeout)

    async def _download_segments(self, data: bytes, timeout: float) -> None:
        toggle = False
        for start in range(0, max(len(data), 1), SEGMENT_MAX):
            chunk = data[start : start + SEGMENT_MAX]
            last = start + SEGMENT_MAX >= len(data)
            segment = Segment(toggle, chunk, last)
            response = await self._exchange(segment, DownloadSegmentResponse, timeout)
            if response.toggle != toggle:
                raise self._abort(AbortCode.TOGGLE_BIT)
            toggle = not toggle

    async def _exchange(self, request: Request, answer: type[Answer], timeout: float) -> Answer:
        expected: Promise[Response] = Promise()
        self._expected, self._answer, self._strays = expected, answer, 0
        self._send(Frame(CobId.SDO_REQUEST + self.node_id, request.encode()))
        try:
            response = await self._scheduler.wait(expected, timeout)
        except TimeoutError:
            self._expected = None
            self.counters.timed_out += 1
            self._send_abort(AbortCode.TIMED_OUT)
            raise SdoTimeoutError(self._silence(timeout)) from None
        if isinstance(response, answer):
            return response
        self.counters.aborted += 1
        code = response.code if isinstance(response, Abort) else AbortCode.COMMAND_SPECIFIER
        raise SdoAbortError(
            f'{self._name} (node {self.node_id}) refused {self._place()}: {abort_text(code)}', code
        )

    def _silence(self, timeout: float) -> str:
        strays = (
            f'; it sent {self._strays} frames that do not belong to the request'
            if self._strays
            else ''
        )
        return (
            f'{self._name} (node {self.node_id}) did not answer the SDO for {self._place()} '
            f'within {timeout * 1000:g} ms{strays}'
        )

    def _abort(self, code: AbortCode) -> SdoAbortError:
        self.counters.aborted += 1
        self._send_abort(code)
        return SdoAbortError(
            f'the answer of {self._name} (node {self.node_id}) for {self._place()} '
            f'was not understood: {abort_text(code)}',
            code,
        )

    def _send_abort(self, code: AbortCode) -> None:
        frame = Abort(*self._address, code).encode()
        self._send(Frame(CobId.SDO_REQUEST + self.node_id, frame))

    def _place(self) -> str:
        index, subindex = self._address
        return f'object 0x{index:04X}:{subindex:02X}'
