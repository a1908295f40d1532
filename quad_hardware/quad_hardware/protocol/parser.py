# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Finds frames in a stream of bytes that may be cut anywhere and hold anything."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import auto, Enum

from .frame import ADDRESS_AT, checksum, Frame, HEADER, KIND_AT, LENGTH_AT, TAIL
from .schema import Kind, Protocol

_AFTER_CHECKSUM = len(TAIL) + 1


@dataclass(slots=True)
class ParserCounters:
    """What a parser has seen since its start."""

    bytes: int = 0  # bytes fed
    frames: int = 0  # valid frames
    skipped: int = 0  # bytes that belong to no valid frame
    bad_kind: int = 0  # headers followed by a kind of frame that is not expected from this side
    bad_tail: int = 0  # candidates without the tail where their length says it is
    bad_checksum: int = 0  # candidates with header, length and tail, and a wrong checksum

    @property
    def damaged(self) -> int:
        """Candidates that looked like a frame and were none."""
        return self.bad_tail + self.bad_checksum


class _Verdict(Enum):
    VALID = auto()
    INCOMPLETE = auto()
    WRONG = auto()


class StreamParser:
    """Yields the valid frames of a byte stream, in order.

    A candidate that is no valid frame costs one byte: the search goes on at its second byte, so
    that a frame that begins inside a damaged one is found. The buffer never holds more than one
    incomplete frame after a call.
    """

    def __init__(self, protocol: Protocol, kinds: frozenset[Kind]) -> None:
        """Begin with an empty buffer.

        Args:
            kinds: Kinds that the other side sends: ``ROBOT_KINDS`` or ``HOST_KINDS``.
        """
        self._protocol = protocol
        self._kinds = {int(kind): kind for kind in kinds & protocol.kinds}
        self._buffer = bytearray()
        self._counters = ParserCounters()

    @property
    def counters(self) -> ParserCounters:
        """A copy of the counters."""
        return replace(self._counters)

    @property
    def pending(self) -> int:
        """Bytes that wait for the rest of their frame."""
        return len(self._buffer)

    def feed(self, data: bytes) -> list[Frame]:
        """Take bytes and return the frames that they complete."""
        self._counters.bytes += len(data)
        self._buffer += data
        return self._scan(more_comes=True)

    def expire(self) -> list[Frame]:
        """Give up waiting for the rest of a frame, and look for frames behind its header.

        To be called when the line was quiet for longer than a pause inside a frame can be: three
        bytes of noise may look like the start of a long frame and would hold back a short one.
        """
        return self._scan(more_comes=False)

    def _scan(self, *, more_comes: bool) -> list[Frame]:
        buffer, frames, position = self._buffer, [], 0
        while True:
            start = buffer.find(HEADER, position)
            if start < 0:
                end = len(buffer) - (more_comes and buffer.endswith(HEADER[:1]))
                self._counters.skipped += max(end - position, 0)
                position = max(end, position)
                break
            self._counters.skipped += start - position
            position = start
            verdict, length = self._judge(position)
            if verdict is _Verdict.VALID:
                frames.append(self._cut(position, length))
                position += length
            elif verdict is _Verdict.INCOMPLETE and more_comes:
                break
            else:
                self._counters.skipped += 1
                position += 1
        del buffer[:position]
        self._counters.frames += len(frames)
        return frames

    def _judge(self, start: int) -> tuple[_Verdict, int]:
        buffer, counters = self._buffer, self._counters
        available = len(buffer) - start
        if available <= LENGTH_AT:
            return _Verdict.INCOMPLETE, 0
        length = buffer[start + LENGTH_AT]
        if not self._protocol.overhead <= length <= self._protocol.max_length:
            return _Verdict.WRONG, 0
        if available > KIND_AT and buffer[start + KIND_AT] not in self._kinds:
            counters.bad_kind += 1
            return _Verdict.WRONG, 0
        if available < length:
            return _Verdict.INCOMPLETE, 0
        end = start + length
        if buffer[end - len(TAIL) : end] != TAIL:
            counters.bad_tail += 1
            return _Verdict.WRONG, 0
        body = buffer[start + len(HEADER) : end - _AFTER_CHECKSUM]
        if checksum(body) != buffer[end - _AFTER_CHECKSUM]:
            counters.bad_checksum += 1
            return _Verdict.WRONG, 0
        return _Verdict.VALID, length

    def _cut(self, start: int, length: int) -> Frame:
        buffer = self._buffer
        payload_at = start + ADDRESS_AT + self._protocol.address_size
        return Frame(
            kind=self._kinds[buffer[start + KIND_AT]],
            address=int.from_bytes(buffer[start + ADDRESS_AT : payload_at], 'big'),
            payload=bytes(buffer[payload_at : start + length - _AFTER_CHECKSUM]),
        )
