# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages that are published often: serialized once, and only their numbers replaced.

To make a message object of ROS, and to have rclpy take it apart, costs several times as much as
everything that is computed for it. So the first message of a form is made and serialized with
marks in place of its numbers; where the marks are found, the numbers of the others go.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from operator import itemgetter
import struct
from typing import Any, Protocol

from builtin_interfaces.msg import Time
from rclpy.publisher import Publisher
from rclpy.serialization import serialize_message

from ..exceptions import HardwareError

NANOSECONDS = 1_000_000_000  # in a second
_MARK = -1.2345678901234567e234  # times 1, 2, 3...: numbers that no message holds by itself
_SECONDS_MARK, _NANOSECONDS_MARK = 0x5EC0ABCD, 0xA0ABCDEF
_LITTLE_ENDIAN = 1  # in the second byte of a serialized message


class Form(Hashable, Protocol):
    """What messages that differ by their numbers have in common."""

    @property
    def count(self) -> int:
        """How many numbers a message takes."""

    def message(self, stamp: Time, numbers: Sequence[float]) -> Any:  # noqa: ANN401  any message
        """Make a message; each number stands in it as it is, once or several times."""


class Template:
    """The bytes of a message, with gaps for its stamp and numbers."""

    def __init__(self, form: Form) -> None:
        """Make the first message and find its numbers.

        Raises:
            HardwareError: The form does not put every number into the message.
        """
        marks = [_MARK * (index + 1) for index in range(form.count)]
        stamp = Time(sec=_SECONDS_MARK, nanosec=_NANOSECONDS_MARK)
        data = bytes(serialize_message(form.message(stamp, marks)))
        order = '<' if data[1] == _LITTLE_ENDIAN else '>'
        values = [('i', _SECONDS_MARK), ('I', _NANOSECONDS_MARK), *(('d', mark) for mark in marks)]
        gaps = []
        for index, (letter, mark) in enumerate(values):
            places = _places(data, struct.pack(order + letter, mark))
            if not places:
                raise HardwareError(f'{form} does not take number {index} of its messages')
            gaps += [(place, letter, index) for place in places]
        self._cut(data, order, sorted(gaps))

    def _cut(self, data: bytes, order: str, gaps: Sequence[tuple[int, str, int]]) -> None:
        """Cut into what stays and what is filled in, in the order of the bytes."""
        constants: list[bytes] = []
        layout, sources, at = order, [], 0
        for place, letter, index in gaps:
            if place > at:
                layout += f'{place - at}s'
                sources.append(-len(constants) - 1)  # constants stand behind, last first
                constants.append(data[at:place])
            layout += letter
            sources.append(index)
            at = place + struct.calcsize(order + letter)
        layout += f'{len(data) - at}s'
        sources.append(-len(constants) - 1)
        constants.append(data[at:])
        self._layout = struct.Struct(layout)
        self._arrange = itemgetter(*sources)
        self._constants = tuple(reversed(constants))

    def fill(self, time: int, numbers: Sequence[float]) -> bytes:
        """Return the serialized message of a time [ns] and numbers."""
        values = (*divmod(time, NANOSECONDS), *numbers, *self._constants)
        return self._layout.pack(*self._arrange(values))


def _places(data: bytes, mark: bytes) -> list[int]:
    places, at = [], data.find(mark)
    while at >= 0:
        places.append(at)
        at = data.find(mark, at + len(mark))
    return places


class Stream:
    """A topic on which messages of few forms are published often."""

    def __init__(self, publisher: Publisher) -> None:
        """Publish there."""
        self._publisher = publisher
        self._templates: dict[Form, Template] = {}

    def publish(self, form: Form, time: int, numbers: Sequence[float]) -> None:
        """Publish a message of a form, with a time [ns] and numbers.

        Raises:
            HardwareError: The form does not put every number into the message.
        """
        template = self._templates.get(form)
        if template is None:
            template = self._templates[form] = Template(form)
        self._publisher.publish(template.fill(time, numbers))
