# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The last bytes of a serial line for a black box, written as a serial log."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Iterator
from itertools import islice
from pathlib import Path
import time
from typing import TypeAlias

from black_box import Pause

from .serial_log import format_event, format_transfer, HEADER, Opened, StateEntered

LOG = 'serial.log'
EVENTS = 1000  # changes of the link that are kept at most; in a minute there are some dozens
_CHUNK = 32  # lines that are written at once

_Bytes: TypeAlias = tuple[float, bytes, bool]


class SerialMemory:
    """Keeps what was read and written, and the states of the link.

    Bytes are kept as tuples of plain values, which the garbage collector does not follow. One
    thread records, another one may write meanwhile; nothing is locked.
    """

    def __init__(self, port: str, window: float) -> None:
        """Begin with nothing.

        Args:
            window: How far back it reaches [s].
        """
        self._port, self._window = port, window
        self._transfers: deque[_Bytes] = deque()
        self._events: deque[Opened | StateEntered] = deque(maxlen=EVENTS)

    def transfer(self, now: float, data: bytes, sent: bool) -> None:
        """Keep bytes, and drop those that are older than the window."""
        transfers = self._transfers
        transfers.append((now, data, sent))
        begin = now - self._window
        while transfers[0][0] < begin:
            transfers.popleft()

    def event(self, event: Opened | StateEntered) -> None:
        """Keep a robot that was found, or a change of the link's state."""
        self._events.append(event)

    @property
    def size(self) -> int:
        """How many bytes of the line are kept."""
        return sum(len(data) for _, data, _ in tuple(self._transfers))

    @property
    def about(self) -> str:
        """The port, and how much of it is kept."""
        opened = _last(tuple(self._events), Opened)
        robot = 'no robot was found'
        if isinstance(opened, Opened):
            robot = f'robot: {opened.firmware}, protocol {opened.protocol} at {opened.baud} baud'
        return (
            f'black box of the serial port {self._port}: the last {self._window:g} s, in {LOG}\n'
            f'{robot}'
        )

    def save(self, folder: Path, pause: Pause) -> Path:
        """Write what the window has, in the order in which it happened.

        The robot that was found before, and the state of then, stand at its beginning.

        Args:
            pause: Called after each small piece of work.

        Raises:
            OSError: The file cannot be written.
        """
        now = time.monotonic()
        offset, begin = time.time() - now, now - self._window
        transfers, events = tuple(self._transfers), tuple(self._events)  # each in one step
        path = folder / LOG
        with path.open('w', encoding='utf-8') as file:
            file.write(HEADER)
            lines = _merged(transfers, _since(events, begin), begin, offset)
            while chunk := list(islice(lines, _CHUNK)):
                file.write(''.join(chunk))
                pause()
        return path

    def usage(self, path: Path) -> str:
        """Return the commands that show the log."""
        return f'less {path}\nros2 run quad_hardware replay --ros-args -p log:={path}'


def _since(
    events: tuple[Opened | StateEntered, ...], begin: float
) -> list[tuple[float, Opened | StateEntered]]:
    """Return events with their times, those that still held at the beginning as if of then."""
    before = tuple(event for event in events if event.time < begin)
    opened, entered = _last(before, Opened), _last(before, StateEntered)
    held = [event for event in (opened, entered) if event is not None]
    held.sort(key=lambda event: event.time)
    later = [(event.time, event) for event in events if event.time >= begin]
    return [(begin, event) for event in held] + later


def _last(
    events: tuple[Opened | StateEntered, ...], kind: type[Opened | StateEntered]
) -> Opened | StateEntered | None:
    return next((event for event in reversed(events) if isinstance(event, kind)), None)


def _merged(
    transfers: Iterable[_Bytes],
    events: list[tuple[float, Opened | StateEntered]],
    begin: float,
    offset: float,
) -> Iterator[str]:
    """Yield lines in the order of their times, on the wall clock."""
    left = deque(events)
    for at, data, sent in transfers:
        if at < begin:
            continue
        while left and left[0][0] < at:
            time_of, event = left.popleft()
            yield format_event(event, time_of + offset)
        yield format_transfer(at + offset, data, sent=sent)
    for time_of, event in left:
        yield format_event(event, time_of + offset)
