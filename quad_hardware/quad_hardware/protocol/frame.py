# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Building blocks of protocol tables; encoding, decoding and parsing of frames.

Encoder, decoder, simulated robot and protocol page all read the same table, so a layout change is
a change of one row. The parser accepts arbitrary input.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from enum import Enum, Flag, IntEnum
from itertools import chain
import math
import struct

from ..exceptions import CodecError


class Kind(IntEnum):
    """Purpose of a frame: its TYPE byte."""

    WRITE = 0x00  # host to robot, not answered; what the developer firmware pushes, too
    READ = 0x02  # host to robot
    REPLY = 0x12  # robot to host, answers READ
    NACK = 0x1F  # robot to host, refuses a frame (v2 only)
    PUSH = 0x20  # robot to host, unasked (v2 only)


HOST_KINDS = frozenset({Kind.WRITE, Kind.READ})  # what a host sends
ROBOT_KINDS = frozenset({Kind.REPLY, Kind.NACK, Kind.PUSH})  # what a robot sends


class Scalar(Enum):
    """Number formats on the wire, in :mod:`struct` notation."""

    U8 = '<B'
    U16 = '<H'
    U32 = '<I'
    I16 = '<h'
    F32 = '<f'
    U16_BE = '>H'
    I16_BE = '>h'

    @property
    def size(self) -> int:
        """Size [B]."""
        return struct.calcsize(self.value)


class Access(Flag):
    """Frame kinds that may carry a function."""

    READ = 1
    WRITE = 2
    PUSH = 4


class Model(Enum):
    """Robot models, which differ in the ranges that scale their bytes."""

    MINI = 'mini'
    LITE = 'lite'
    WHEELED = 'wheeled'  # mini2SW and mini3W


@dataclass(frozen=True, slots=True)
class Span:
    """Range of a quantity that a byte 0 to 255 covers."""

    low: float  # value of byte 0
    high: float  # value of byte 255

    def encode(self, value: float) -> int:
        """Return the nearest byte; clamp values outside of the range.

        Raises:
            CodecError: The value is not finite.
        """
        if math.isnan(value):
            raise CodecError('NaN has no byte; send a number')
        share = (min(max(value, self.low), self.high) - self.low) / (self.high - self.low)
        return math.floor(share * 255 + 0.5)

    def decode(self, byte: int) -> float:
        """Return the value of a byte."""
        return byte / 255 * (self.high - self.low) + self.low


@dataclass(frozen=True, slots=True)
class Field:
    """A sequence of equally formatted numbers in a payload."""

    name: str  # key in what :meth:`Function.unpack` returns
    scalar: Scalar  # number format
    offset: int = 0  # first byte in the payload [B]
    count: int = 1  # how many numbers
    scale: float = 1.0  # unit of one step on the wire, for integers
    unit: str = ''  # unit of the value
    meaning: str = ''  # for the protocol page

    @property
    def size(self) -> int:
        """Size of the whole sequence [B]."""
        return self.scalar.size * self.count

    def steps(self, values: Iterable[float]) -> tuple[float, ...]:
        """Convert the values of one or more sequences to the numbers on the wire.

        Raises:
            CodecError: The number of values is wrong.
        """
        numbers = tuple(values)
        if not numbers or len(numbers) % self.count:
            raise CodecError(f'{self.name}: {len(numbers)} values given, {self.count} needed')
        if self.scalar is Scalar.F32:
            return numbers
        return tuple(round(value / self.scale) for value in numbers)

    def scaled(self, numbers: tuple[float, ...]) -> tuple[float, ...]:
        """Convert numbers on the wire to values in their unit."""
        return numbers if self.scale == 1.0 else tuple(n * self.scale for n in numbers)


@dataclass(frozen=True, slots=True)
class Function:
    """A row of a protocol table."""

    address: int  # what stands in the frame
    name: str  # short name, unique in the table
    access: Access  # which kinds of frame carry it
    fields: tuple[Field, ...]  # payload, in the order of offsets
    meaning: str  # for the protocol page
    # the fields describe one group of several; a payload holds one group or more
    repeated: bool = False
    # length of the payload [B] where it is longer than its fields (filled with zeros)
    size: int = 0
    # what a byte 0 to 255 spreads over, for functions of one byte
    spans: Mapping[Model, Span] = field(default_factory=dict)
    unit: str = ''  # unit of the spans
    variable: bool = False  # payloads may also be shorter
    length: int = field(init=False)  # length of a payload, or of one group of it [B]
    order: str = field(init=False)  # byte order of the numbers for :mod:`struct`
    # format of the whole payload, or of one group of it, without the order
    layout: str = field(init=False)

    def __post_init__(self) -> None:
        """Precompute length and format: states and targets are coded 50 times a second."""
        layout, end = '', 0
        for part in self.fields:
            if part.offset < end:
                raise ValueError(f'{self.name}: {part.name} begins inside the field before it')
            layout += f'{part.offset - end}x{part.count}{part.scalar.value[1:]}'
            end = part.offset + part.size
        (order,) = {part.scalar.value[0] for part in self.fields}  # all numbers have one
        length = max(self.size, end)
        object.__setattr__(self, 'length', length)
        object.__setattr__(self, 'order', order)
        object.__setattr__(self, 'layout', f'{layout}{length - end}x')

    def accepts(self, length: int) -> bool:
        """Return whether a payload may have this length [B]."""
        if self.repeated:
            return length > 0 and length % self.length == 0
        return 0 < length <= self.length if self.variable else length == self.length

    def pack(self, **values: Iterable[float]) -> bytes:
        """Encode a payload; each repeated field has the values of all groups.

        Raises:
            CodecError: A field is missing or unknown, or its values do not fit.
        """
        if wrong := values.keys() ^ {part.name for part in self.fields}:
            raise CodecError(f'{self.name}: {", ".join(sorted(wrong))} missing or unknown')
        given = {part.name: tuple(values[part.name]) for part in self.fields}
        try:
            runs = [(part.count, part.steps(given[part.name])) for part in self.fields]
            groups = {len(steps) // count for count, steps in runs}
            if len(groups) > 1 or (groups != {1} and not self.repeated):
                raise CodecError(f'{self.name}: {given} are not as many as its fields')
            numbers = [
                number
                for group in range(*groups)
                for count, steps in runs
                for number in steps[group * count : (group + 1) * count]
            ]
            return struct.pack(self.order + self.layout * groups.pop(), *numbers)
        except (struct.error, ValueError, OverflowError) as error:
            if isinstance(error, CodecError):
                raise
            raise CodecError(f'{self.name}: {given} do not fit its fields') from error

    def unpack(self, payload: bytes) -> dict[str, tuple[float, ...]]:
        """Decode a payload; each repeated field has the values of all groups in one tuple.

        Raises:
            CodecError: The function has no payload of this length.
        """
        if not self.accepts(len(payload)) or len(payload) % self.length:
            raise CodecError(f'{self.name}: payload of {len(payload)} bytes, not {self.length}')
        groups = list(struct.iter_unpack(self.order + self.layout, payload))
        values, at = {}, 0
        for part in self.fields:
            runs = (group[at : at + part.count] for group in groups)
            values[part.name] = part.scaled(tuple(chain.from_iterable(runs)))
            at += part.count
        return values


@dataclass(frozen=True, slots=True, eq=False)
class Protocol:
    """A serial protocol: frame format and function table.

    Every frame is ``55 00 | LEN | TYPE | address | payload | CHK | 00 AA``; LEN counts the whole
    frame, CHK is 255 minus the sum of everything from LEN to the payload, modulo 256.
    """

    name: str  # name for people, and of the parameter that chooses it
    origin: str  # where the layout is from
    baud: int  # speed of the line [bit/s], 8N1
    address_size: int  # bytes of an address, the most significant first [B]
    kinds: frozenset[Kind]  # kinds of frame that there are
    functions: Mapping[int, Function]  # the table, by address
    max_length: int = 255  # longest frame [B]
    other_write: int | None = None  # a TYPE that some hosts send for a write, too

    @property
    def overhead(self) -> int:
        """Size of a frame without payload [B]."""
        return 7 + self.address_size

    def wire_time(self, length: int) -> float:
        """Return how long this many bytes take on the line [s]: ten bits each in 8N1."""
        return length * 10 / self.baud


def table(*rows: Function) -> dict[int, Function]:
    """Index rows by address.

    Raises:
        ValueError: Two rows have the same address or name.
    """
    result = {row.address: row for row in rows}
    if len(result) != len(rows) or len({row.name for row in rows}) != len(rows):
        raise ValueError('a protocol table names an address or a name twice')
    return result


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
            CodecError: The payload is too long, the address too large, or the protocol lacks
                this kind of frame.
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
    """Return the checksum of the bytes between header and checksum."""
    return 255 - sum(body) % 256


_AFTER_CHECKSUM = len(TAIL) + 1


@dataclass(slots=True)
class ParserCounters:
    """Counters of a parser since its start."""

    bytes: int = 0  # bytes fed
    frames: int = 0  # valid frames
    skipped: int = 0  # bytes that belong to no valid frame
    bad_kind: int = 0  # headers followed by a kind of frame that is not expected from this side
    bad_tail: int = 0  # candidates without the tail where their length says it is
    bad_checksum: int = 0  # candidates with header, length and tail, and a wrong checksum

    @property
    def damaged(self) -> int:
        """Number of candidates that looked like a frame but were invalid."""
        return self.bad_tail + self.bad_checksum


class StreamParser:
    """Yields the valid frames of a byte stream, in order.

    After an invalid candidate, the search continues at its second byte, so that a frame that
    begins inside a damaged one is found. The buffer never holds more than one incomplete frame
    after a call.
    """

    def __init__(self, protocol: Protocol, kinds: frozenset[Kind]) -> None:
        """Start with an empty buffer; the peer sends ``ROBOT_KINDS`` or ``HOST_KINDS``."""
        self._protocol = protocol
        # the developer firmware has one kind, for both directions
        self._kinds = {int(kind): kind for kind in kinds & protocol.kinds or protocol.kinds}
        if Kind.WRITE in kinds and protocol.other_write is not None:
            self._kinds[protocol.other_write] = Kind.WRITE
        self._buffer = bytearray()
        self.counters = ParserCounters()

    @property
    def pending(self) -> int:
        """Number of buffered bytes of an incomplete frame."""
        return len(self._buffer)

    def feed(self, data: bytes) -> list[Frame]:
        """Parse bytes; return the completed frames."""
        self.counters.bytes += len(data)
        self._buffer += data
        return self._scan(more_comes=True)

    def expire(self) -> list[Frame]:
        """Abandon an incomplete frame, and search for frames behind its header.

        Call it after the line was quiet for longer than any pause inside a frame: three bytes of
        noise may look like the start of a long frame and would delay a short one.
        """
        return self._scan(more_comes=False)

    def _scan(self, *, more_comes: bool) -> list[Frame]:
        buffer, frames, position = self._buffer, [], 0
        while True:
            start = buffer.find(HEADER, position)
            if start < 0:
                end = len(buffer) - (more_comes and buffer.endswith(HEADER[:1]))
                self.counters.skipped += max(end - position, 0)
                position = max(end, position)
                break
            self.counters.skipped += start - position
            position = start
            length = self._frame_length(position)
            if length:
                frames.append(self._cut(position, length))
                position += length
            elif length is None and more_comes:
                break
            else:
                self.counters.skipped += 1
                position += 1
        del buffer[:position]
        self.counters.frames += len(frames)
        return frames

    def _frame_length(self, start: int) -> int | None:
        """Return the length of the frame after a header; 0 for none, None if incomplete."""
        buffer, counters = self._buffer, self.counters
        available = len(buffer) - start
        if available <= LENGTH_AT:
            return None
        length = buffer[start + LENGTH_AT]
        if not self._protocol.overhead <= length <= self._protocol.max_length:
            return 0
        if available > KIND_AT and buffer[start + KIND_AT] not in self._kinds:
            counters.bad_kind += 1
            return 0
        if available < length:
            return None
        end = start + length
        if buffer[end - len(TAIL) : end] != TAIL:
            counters.bad_tail += 1
            return 0
        body = buffer[start + len(HEADER) : end - _AFTER_CHECKSUM]
        if checksum(body) != buffer[end - _AFTER_CHECKSUM]:
            counters.bad_checksum += 1
            return 0
        return length

    def _cut(self, start: int, length: int) -> Frame:
        buffer = self._buffer
        payload_at = start + ADDRESS_AT + self._protocol.address_size
        return Frame(
            kind=self._kinds[buffer[start + KIND_AT]],
            address=int.from_bytes(buffer[start + ADDRESS_AT : payload_at], 'big'),
            payload=bytes(buffer[payload_at : start + length - _AFTER_CHECKSUM]),
        )
