# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames of both protocols: as values, as bytes, and found in a stream that may hold anything."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import auto, Enum

from ..exceptions import CodecError
from .schema import Kind, Protocol

HEADER = b'\x55\x00'
TAIL = b'\x00\xaa'
LENGTH_AT, KIND_AT, ADDRESS_AT = 2, 3, 4  # [B] from the start of a frame


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame."""

    kind: Kind  # what it is for
    address: int  # register (v1), or ``main << 8 | sub`` (v2)
    payload: bytes = b''  # data; of a READ of protocol v1, one byte: how many to read

    def encode(self, protocol: Protocol) -> bytes:
        """Return the bytes on the wire.

        Raises:
            CodecError: The payload is too long, the address too large, or the protocol has no
                such kind of frame.
        """
        length = protocol.overhead + len(self.payload)
        if length > protocol.max_length:
            raise CodecError(
                f'payload of {len(self.payload)} bytes: a frame of protocol {protocol.name} '
                f'takes {protocol.max_length - protocol.overhead}; send it in parts'
            )
        if self.kind not in protocol.kinds:
            raise CodecError(f'protocol {protocol.name} has no frame of kind {self.kind.name}')
        try:
            address = self.address.to_bytes(protocol.address_size, 'big')
        except OverflowError as error:
            raise CodecError(
                f'address {self.address:#x} does not fit protocol {protocol.name}'
            ) from error
        body = bytes((length, self.kind)) + address + self.payload
        return HEADER + body + bytes((checksum(body),)) + TAIL


def checksum(body: bytes | bytearray | memoryview) -> int:
    """Return the checksum of what stands between header and checksum."""
    return 255 - sum(body) % 256


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
        """Parse bytes; return the frames that they complete."""
        self._counters.bytes += len(data)
        self._buffer += data
        return self._scan(more_comes=True)

    def expire(self) -> list[Frame]:
        """Stop waiting for the rest of a frame, and search for frames behind its header.

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
