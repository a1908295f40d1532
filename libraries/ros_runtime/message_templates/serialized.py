# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Serializes frequent messages once; then only writes or reads the stamp and numbers.

Creating a ROS message object, or deserializing one by rclpy, costs several times as much as all
that a controller computes for it. So one message of a form is serialized with marker values as
numbers; the positions of the markers are those of the numbers in all other messages.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator, Sequence
from copy import deepcopy
from dataclasses import dataclass
from functools import reduce
from operator import itemgetter
import struct
from typing import Any

from builtin_interfaces.msg import Time
from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message, serialize_message

NANOSECONDS = 1_000_000_000  # in a second
MISSES_MAX = 3  # messages of another form one after the other, until forms are not looked for
_MARK = -1.2345678901234567e30  # times 1, 2, 3...: numbers that no message holds by itself
_SECONDS_MARK, _NANOSECONDS_MARK = 0x5EC0ABCD, 0xA0ABCDEF
_ENCAPSULATION, _LITTLE_ENDIAN = 1, 1  # byte of a serialized message of its order [B]
_HEADER = 4  # where the message itself begins [B]


@dataclass(frozen=True, slots=True)
class MessageTemplate:
    """Template of messages that differ only in their stamp and numbers."""

    make: Callable[..., Any]  # of stamp, numbers, and the arguments
    count: int  # how many numbers a message takes
    arguments: tuple[Hashable, ...] = ()  # what does not change from one message to the next

    def message(self, stamp: Time, numbers: Sequence[float]) -> Any:  # noqa: ANN401  any message
        """Create a message; each number appears in it unchanged, once or several times."""
        return self.make(stamp, numbers, *self.arguments)


@dataclass(frozen=True, slots=True)
class _Gap:
    """Position of a number in the bytes of a message."""

    place: int  # [B]
    letter: str  # of its format
    index: int  # among the numbers


class _Pieces:
    """The bytes of a message, split into numbers and the constant bytes between them."""

    def __init__(self, data: bytes, gaps: Sequence[_Gap]) -> None:
        order, at, layout = _order(data), 0, ''
        self.constants: list[bytes] = []
        self.sources: list[int | None] = []  # which number a piece is; None for a constant
        for gap in sorted(gaps, key=lambda gap: gap.place):
            if gap.place > at:
                layout += self._constant(data[at : gap.place])
            layout += gap.letter
            self.sources.append(gap.index)
            at = gap.place + struct.calcsize(order + gap.letter)
        if len(data) > at:
            layout += self._constant(data[at:])
        self.layout = struct.Struct(order + layout)  # all pieces in the order of the bytes

    def _constant(self, data: bytes) -> str:
        self.constants.append(data)
        self.sources.append(None)
        return f'{len(data)}s'


def _order(data: bytes) -> str:
    return '<' if data[_ENCAPSULATION] == _LITTLE_ENDIAN else '>'


def _marks(count: int) -> list[float]:
    return [_MARK * (index + 1) for index in range(count)]


def _gaps(data: bytes, count: int) -> list[_Gap]:
    """Find the markers of a stamp and of ``count`` numbers; markers count up from 2."""
    values = [('i', _SECONDS_MARK), ('I', _NANOSECONDS_MARK), *(('df', m) for m in _marks(count))]
    gaps = []
    for index, (letters, mark) in enumerate(values):
        found = [
            _Gap(place, letter, index)
            for letter in letters
            for place in _places(data, struct.pack(_order(data) + letter, mark))
        ]
        if not found:
            raise ValueError(f'number {index - 2} of {count} is not in the message')
        gaps += found
    return gaps


def _places(data: bytes, mark: bytes) -> Iterator[int]:
    at = data.find(mark)
    while at >= 0:
        yield at
        at = data.find(mark, at + len(mark))


class SerializedTemplate:
    """The bytes of a message, with gaps for its stamp and numbers."""

    def __init__(self, form: MessageTemplate) -> None:
        """Serialize a first message and locate its numbers.

        Raises:
            ValueError: The form omits its stamp or one of its numbers from the message.
        """
        stamp = Time(sec=_SECONDS_MARK, nanosec=_NANOSECONDS_MARK)
        data = bytes(serialize_message(form.message(stamp, _marks(form.count))))
        pieces = _Pieces(data, _gaps(data, form.count))
        constants = iter(range(form.count + 2, form.count + 2 + len(pieces.constants)))
        order = [next(constants) if source is None else source for source in pieces.sources]
        self._constants, self._pack = pieces.constants, pieces.layout.pack
        self._arrange = itemgetter(*order)

    def fill(self, time: int, numbers: Sequence[float]) -> bytes:
        """Return the serialized message with a stamp in [ns] and numbers.

        Raises:
            OverflowError: A number does not fit a float32.
        """
        values = (*divmod(time, NANOSECONDS), *numbers, *self._constants)
        return self._pack(*self._arrange(values))


class FastPublisher:
    """Publishes messages of few forms at a high rate."""

    def __init__(self, publisher: Publisher) -> None:
        """Publish with an rclpy publisher."""
        self._publisher = publisher
        self._templates: dict[MessageTemplate, SerializedTemplate] = {}

    def publish(self, form: MessageTemplate, time: int, numbers: Sequence[float]) -> None:
        """Publish a message of a form, with a stamp in [ns] and numbers."""
        template = self._templates.get(form)
        if template is None:
            template = self._templates[form] = SerializedTemplate(form)
        self._publisher.publish(template.fill(time, numbers))


def stamp_of(data: bytes) -> int:
    """Return the stamp in [ns] of a serialized message that begins with its header."""
    seconds, nanoseconds = struct.unpack_from(_order(data) + 'iI', data, _HEADER)
    return int(seconds * NANOSECONDS + nanoseconds)


class FastReader:
    """Reads serialized messages with a header, from a subscription with ``raw=True``.

    While only stamp and numbers change, it reads just these; any other message is deserialized in
    full. So are all messages of a publisher that never sends the same form twice.
    """

    def __init__(self, kind: type, *paths: str) -> None:
        """Create a reader for the numbers at ``paths`` in messages of a type.

        A path such as ``twist.linear.x`` names a float or a sequence of floats.
        """
        self._kind = kind
        self._paths = [path.split('.') for path in paths]
        self._message: Any = None
        self._constants: tuple[bytes, ...] = ()
        self._unpack: struct.Struct | None = None
        self._misses = 0

    def read(self, data: bytes) -> tuple[Any, Sequence[float]]:
        """Read a message.

        Returns:
            A message, valid except for its stamp and numbers, and the same object while only these
            change; and the numbers, path by path.
        """
        if self._unpack is not None and len(data) == self._unpack.size:
            pieces = self._unpack.unpack(data)
            if self._still(pieces) == self._constants:
                self._misses = 0
                return self._message, self._numbers(pieces)
        return self._read_anew(data)

    def _read_anew(self, data: bytes) -> tuple[Any, Sequence[float]]:
        message = deserialize_message(data, self._kind)
        numbers = [number for path in self._paths for number in _floats(message, path)]
        self._misses += 1
        if self._misses <= MISSES_MAX:
            self._learn(data, message, len(numbers))
        return message, numbers

    def _learn(self, data: bytes, message: Any, count: int) -> None:  # noqa: ANN401
        """Store where the numbers are, if our own serialization has the same layout."""
        marked, marks = deepcopy(message), iter(_marks(count))
        marked.header.stamp = Time(sec=_SECONDS_MARK, nanosec=_NANOSECONDS_MARK)
        for path in self._paths:
            _mark(marked, path, marks)
        ours = bytes(serialize_message(marked))
        if count < 1 or len(ours) != len(data) or _order(ours) != _order(data):
            return
        pieces = _Pieces(data, _gaps(ours, count))
        places = {source: place for place, source in enumerate(pieces.sources)}
        still = [place for place, source in enumerate(pieces.sources) if source is None]
        self._still = _getter(still)
        self._numbers = _getter([places[index + 2] for index in range(count)])
        self._message, self._constants, self._unpack = (
            message,
            tuple(pieces.constants),
            pieces.layout,
        )


def _getter(places: Sequence[int]) -> Any:  # noqa: ANN401  itemgetter has no type for this
    if len(places) == 1:
        return itemgetter(slice(places[0], places[0] + 1))  # a tuple, too
    return itemgetter(*places)


def _floats(message: Any, path: Sequence[str]) -> Sequence[float]:  # noqa: ANN401
    value = reduce(getattr, path, message)
    return [value] if isinstance(value, float) else value


def _mark(message: Any, path: Sequence[str], marks: Iterator[float]) -> None:  # noqa: ANN401
    *way, last = path
    owner = reduce(getattr, way, message)
    value = getattr(owner, last)
    single = isinstance(value, float)
    setattr(owner, last, next(marks) if single else [next(marks) for _ in value])
