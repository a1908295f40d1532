# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SDO requests to the server of a device, one at a time, and their responses (CiA 301, 7.2.4)."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
import math
from typing import Any, TypeAlias, TypeVar

from canopen_core import BusError, CodecError, SdoAbortError, SdoTimeoutError
from canopen_core.can import Frame
from canopen_core.standard import abort_text, AbortCode, CobId, object_address, sdo

from .frame_sender import Send
from .scheduler import Promise, Scheduler

T = TypeVar('T')
Answer = TypeVar(
    'Answer', sdo.UploadResponse, sdo.Segment, sdo.DownloadResponse, sdo.DownloadSegmentResponse
)
Address: TypeAlias = tuple[int, int]
Match: TypeAlias = Callable[[bytes], T | None]

REPEAT_AFTER = 0.25  # [s] before a request that may be repeated is sent again
MARKERS: tuple[Address, ...] = ((0x1000, 0), (0x1001, 0), *((0x1018, sub) for sub in range(5)))
"""Objects that a device has or refuses (CiA 301, table 65); the answer shows where others end."""
_ABORT = b'\x80'
SECOND_ANSWER_TIME = 0.02  # [s] in which another device with the same node id also answers
OTHER_CLIENT_TIME = 1.0  # [s] in which answers to another client arrive
REFUSED_PAUSE = 0.005  # [s] before a frame that the bus has refused is sent again
PENDING_MAX = 16  # outstanding answers to remember


@dataclass(slots=True)
class SdoCounters:
    """Results of the transfers to one device."""

    done: int = 0
    aborted: int = 0
    timed_out: int = 0
    stale: int = 0  # answers that belong to no open request
    doubled: int = 0  # of these: second answers to a request that was sent once
    repeated: int = 0  # requests that were sent again


class SdoChannel:
    """Sends requests to the SDO server of one device and matches the answers.

    An answer names its object, but not its request. So the channel remembers outstanding answers:
    before it reads their object again, it reads another one. As a server answers in order, later
    answers are new.
    """

    def __init__(
        self,
        node_id: int,
        name: str,
        scheduler: Scheduler,
        send: Send,
        on_odd: Callable[[str], None] = lambda text: None,
    ) -> None:
        """``on_odd`` is called once for each kind of odd behaviour of the device."""
        self.counters = SdoCounters()  # results of the transfers
        self.address: Address = (0, 0)  # the object of the present transfer
        self._on_odd = on_odd
        self._odd: set[str] = set()
        self._title = f'{name} (node {node_id})'
        self._request_id = CobId.SDO_REQUEST + node_id
        self._scheduler = scheduler
        self._send = send
        self._answered: Promise[Any] | None = None
        self._match: Match[Any] = lambda data: None
        self._strays = 0  # frames since the open question that do not answer it
        self._pending_replies: list[Address] = []
        self._answered_at: dict[bytes, float] = {}  # when requests that left once were answered
        self._other_client_until = 0.0
        self._restarted = False  # since the present transfer began

    async def begin(
        self, index: int, subindex: int, timeout: float, *, settle: bool = True
    ) -> None:
        """Begin a transfer; exclude answers to earlier ones.

        With ``settle`` it waits at most ``timeout`` in [s] for outstanding answers; otherwise one
        to the same request counts.

        Raises:
            SdoTimeoutError: The device does not answer at all.
        """
        if settle and (index, subindex) in self._pending_replies:
            await self._settle(index, subindex, timeout)
        self.address = (index, subindex)
        self._restarted = False

    def receive(self, data: bytes) -> None:
        """Process a frame of the server.

        Frames that do not answer the open request are ignored: they are late answers, or meant for
        another client.
        """
        if len(data) < sdo.FRAME_BYTES:
            self.note_odd(
                'length',
                f'sends SDO answers of {len(data)} bytes where CiA 301 has 8; they are read where '
                'all is there that they announce, else they count as none. Where SDOs time out, '
                'update its firmware',
            )
        promise = self._answered
        if promise is not None:
            answer = self._abort_of(data) or self._match(data)
            if answer is not None:
                self._answered = None
                if not self._pending_replies:
                    self._answered_at[_object_of(data)] = self._scheduler.now
                promise.resolve(answer)
                return
        self.counters.stale += 1
        self._strays += 1
        named, now = _object_of(data), self._scheduler.now
        if (
            named
            and now - self._answered_at.get(named, -math.inf) <= SECOND_ANSWER_TIME
            and not self._pending_replies
            and now >= self._other_client_until
        ):
            self.counters.doubled += 1

    def note_other_client(self) -> None:
        """Record a request of another client, whose answer is not a second one to ours."""
        self._other_client_until = self._scheduler.now + OTHER_CLIENT_TIME

    def note_odd(self, kind: str, text: str) -> None:
        """Report odd behaviour of the device, once for each kind."""
        if kind not in self._odd:
            self._odd.add(kind)
            self._on_odd(text)

    def cancel(self) -> None:
        """Abort the transfer, whether or not a request is open."""
        answered, self._answered = self._answered, None
        if self._restarted:
            return
        if answered is not None:
            self._await_late_replies(1)
        self._send_abort(AbortCode.GENERAL)

    def restarted(self) -> None:
        """Handle a restart of the device: drop outstanding answers and the transfer."""
        self._restarted = True
        self._pending_replies = []
        self._answered_at.clear()

    def send(self, data: bytes) -> BusError | None:
        """Send a frame without an answer; return the error if the bus refuses it."""
        return self._send(Frame(self._request_id, data))

    async def deliver(self, data: bytes, timeout: float) -> BusError | None:
        """Send a frame, retry for ``timeout`` in [s] if the bus refuses it; return the error."""
        end = self._scheduler.now + timeout
        while (refusal := self.send(data)) is not None and self._scheduler.now < end:
            await self._scheduler.timer(min(REFUSED_PAUSE, end - self._scheduler.now))
        return refusal

    async def exchange(
        self, question: bytes | None, match: Match[T], timeout: float, *, repeat: bool = False
    ) -> T:
        """Send a request, and wait at most ``timeout`` in [s] for the answer that ``match`` reads.

        Without ``question`` it only waits. ``match`` returns None for other answers. With
        ``repeat`` the request is sent again if no answer arrives.

        Raises:
            SdoAbortError: The device refused.
            SdoTimeoutError: It did not answer; it got an abort.
            SdoError: The transfer was cancelled.
        """
        answer = await self._request(question, match, timeout, repeat=repeat)
        if not isinstance(answer, sdo.Abort):
            return answer
        self.counters.aborted += 1
        text = f'{self._title} refused {_place(self.address)}: {abort_text(answer.code)}'
        raise SdoAbortError(text, answer.code)

    async def _request(
        self, question: bytes | None, match: Match[T], timeout: float, *, repeat: bool
    ) -> T | sdo.Abort:
        self._match, self._strays, sent = match, 0, 0
        promise: Promise[T | sdo.Abort] = Promise()
        self._answered = promise
        begin, refusal = self._scheduler.now, None
        for end in _ends_of_waits(timeout, repeat=repeat):
            left = begin + end - self._scheduler.now
            if left <= 0.0:  # time went by in one leap
                continue
            if question is not None:
                refusal = await self.deliver(question, left)
                left = begin + end - self._scheduler.now
            if refusal is not None:
                continue
            sent += 1
            try:
                answer = await self._scheduler.wait(promise, left)
            except TimeoutError:
                continue
            self.counters.repeated += sent - 1
            self._pending_replies = [self.address] * (sent - 1)
            return answer
        self._answered = None
        self._await_late_replies(sent)
        self.counters.timed_out += 1
        self._send_abort(AbortCode.TIMED_OUT)
        if refusal is not None and not sent:
            raise SdoTimeoutError(
                f'the SDO for {_place(self.address)} of {self._title} was not sent: {refusal}'
            )
        raise SdoTimeoutError(self._silence(self.address, timeout))

    def refuse(self, code: AbortCode, detail: str = '') -> SdoAbortError:
        """Abort the transfer because of an invalid answer; return the error to raise."""
        self.counters.aborted += 1
        self._send_abort(code)
        return SdoAbortError(
            f'the answer of {self._title} for {_place(self.address)} was not understood: '
            f'{abort_text(code)}{detail}',
            code,
        )

    async def _settle(self, index: int, subindex: int, timeout: float) -> None:
        """Flush outstanding answers by reading another object."""
        marker = next(
            (place for place in MARKERS if place not in self._pending_replies), MARKERS[0]
        )
        self.address = marker
        question = sdo.UploadRequest(*marker).encode()
        try:
            # a refusal is an answer all the same
            await self._request(
                question, response(sdo.UploadResponse, marker), timeout, repeat=True
            )
        except SdoTimeoutError:
            raise SdoTimeoutError(self._silence((index, subindex), timeout)) from None

    def _await_late_replies(self, sent: int) -> None:
        self._pending_replies = [*self._pending_replies, *[self.address] * sent][-PENDING_MAX:]

    def _abort_of(self, data: bytes) -> sdo.Abort | None:
        if data[:1] != _ABORT:  # what ends a block has the same command specifier
            return None
        try:
            abort = sdo.decode_response(data)
        except CodecError:
            return None
        # python-canopen's peers send aborts with index 0, so such an abort counts for any
        if isinstance(abort, sdo.Abort) and (abort.index, abort.subindex) in (
            self.address,
            (0, 0),
        ):
            return abort
        return None

    def _send_abort(self, code: AbortCode) -> None:
        self.send(sdo.Abort(*self.address, code).encode())

    def _silence(self, address: Address, timeout: float) -> str:
        strays = (
            f'; it sent {self._strays} frames that do not belong to the request'
            if self._strays
            else ''
        )
        return (
            f'{self._title} did not answer the SDO for {_place(address)} '
            f'within {timeout * 1000:g} ms{strays}'
        )


def response(kind: type[Answer], address: Address) -> Match[Answer]:
    """Return a matcher for expedited or segmented answers of a kind for an object."""

    def match(data: bytes) -> Answer | None:
        try:
            answer = sdo.decode_response(data)
        except CodecError:
            return None
        if not isinstance(answer, kind):
            return None
        if isinstance(answer, (sdo.UploadResponse, sdo.DownloadResponse)):
            return answer if (answer.index, answer.subindex) == address else None
        return answer

    return match


def _ends_of_waits(timeout: float, *, repeat: bool) -> Iterator[float]:
    """Yield the end of the wait after each request; each wait is twice the last."""
    wait = min(timeout / 2, REPEAT_AFTER)
    end = wait
    while repeat and timeout - end >= wait:  # no wait is shorter than the first one
        yield end
        wait *= 2
        end += wait
    yield timeout


def _object_of(data: bytes) -> bytes:
    """Return the bytes of index and sub-index in an answer, empty if it has none."""
    return data[1:4] if len(data) >= 4 and data[0] >> 5 in (2, 3, 4) else b''


def _place(address: Address) -> str:
    index, subindex = address
    return f'object {object_address(index, subindex)}'
