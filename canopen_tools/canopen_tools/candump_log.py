# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Log files as ``candump -L`` of can-utils writes them, for canplayer, log2asc and python-can.

::

    (1700000000.123456) can0 181#27060000      11-bit identifier
    (1700000000.123500) can0 00000181#R        29-bit identifier, remote request
    (1700000000.123900) can0 20000004#0004000000000000      error frame
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
import re
from time import monotonic, time
from typing import TextIO

from arm_canopen.can.frame import checked, Frame
from arm_canopen.exceptions import CodecError

_ERROR_FLAG = 0x2000_0000
_STANDARD_DIGITS = 3
_LINE = re.compile(
    r'\((?P<time>\d+\.\d+)\)\s+(?P<channel>\S+)\s+'
    r'(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#'
    r'(?:(?P<remote>[Rr])[0-8]?|(?P<data>(?:[0-9A-Fa-f]{2}\.?){0,8}))'
    r'(?:\s+[RT])?\s*'
)
_PLAYABLE = re.compile(r'[A-Za-z0-9_.-]{1,15}')  # names that a network interface can have
_STAND_IN = 'vcan0'


@dataclass(frozen=True, slots=True)
class LogRecord:
    """One line of a log.

    Attributes:
        time: Wall clock time in [s] since 1970.
        channel: Name of the interface.
        frame: The frame; its own time stamp is 0.
    """

    time: float
    channel: str
    frame: Frame


def format_record(record: LogRecord) -> str:
    """Return the line of a record, without its end."""
    frame = record.frame
    if frame.is_error:
        identifier = f'{frame.can_id | _ERROR_FLAG:08X}'
    else:
        identifier = f'{frame.can_id:08X}' if frame.is_extended else f'{frame.can_id:03X}'
    content = 'R' if frame.is_remote else frame.data.hex().upper()
    return f'({record.time:017.6f}) {record.channel} {identifier}#{content}'


def parse_record(line: str) -> LogRecord:
    """Read a line.

    Raises:
        CodecError: It is no classic CAN frame in candump's format.
    """
    match = _LINE.fullmatch(line.strip())
    if match is None:
        raise CodecError(
            f'{line.strip()!r} is no line such as `(1700000000.123456) can0 181#2706`'
        )
    digits = match['id']
    can_id = int(digits, 16)
    is_error = bool(can_id & _ERROR_FLAG) and len(digits) > _STANDARD_DIGITS
    frame = Frame(
        can_id & ~_ERROR_FLAG if is_error else can_id,
        bytes.fromhex((match['data'] or '').replace('.', '')),
        is_extended=len(digits) > _STANDARD_DIGITS and not is_error,
        is_remote=match['remote'] is not None,
        is_error=is_error,
    )
    if not is_error:
        try:
            checked(frame)
        except ValueError as error:
            raise CodecError(f'{line.strip()!r}: {error}') from error
    return LogRecord(float(match['time']), match['channel'], frame)


def read_log(lines: Iterable[str]) -> Iterator[LogRecord]:
    """Read the lines of a log; like canplayer it skips those that do not begin with a time.

    Raises:
        CodecError: A line is no classic CAN frame; the message has its number.
    """
    for number, line in enumerate(lines, start=1):
        if not line.startswith('('):
            continue
        try:
            yield parse_record(line)
        except CodecError as error:
            raise CodecError(f'line {number}: {error}') from error


def log_channel(bus_name: str) -> str:
    """Return the name for the log: the bus's own when canplayer can play to it, else vcan0."""
    return bus_name if _PLAYABLE.fullmatch(bus_name) else _STAND_IN


class CandumpLog:
    """Writes frames to a log.

    Wall clock times are steady times plus the distance of the clocks at the start, so the log
    runs evenly also when somebody sets the clock.
    """

    def __init__(self, file: TextIO, bus_name: str, wall_offset: float | None = None) -> None:
        """Write to a file that stays the caller's.

        Args:
            file: Where to.
            bus_name: Name of the bus; the log has a name that canplayer can play to.
            wall_offset: Wall clock minus steady clock in [s]; None measures it now.
        """
        self._file = file
        self._channel = log_channel(bus_name)
        self._offset = time() - monotonic() if wall_offset is None else wall_offset

    def write(self, frame: Frame, timestamp: float | None = None) -> None:
        """Write a frame.

        Args:
            frame: The frame.
            timestamp: Steady time in [s]; None takes the frame's own, which a sent one has not.
        """
        stamp = frame.timestamp if timestamp is None else timestamp
        record = LogRecord(stamp + self._offset, self._channel, frame)
        self._file.write(format_record(record) + '\n')
