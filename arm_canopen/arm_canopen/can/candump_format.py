# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Lines of a log as can-utils' ``candump -L`` writes them; without python-can.

python-can takes error frames of such a log for data frames, and writes the same for all of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import re

from ..exceptions import CodecError
from .frame import checked, Frame

_ERROR_FLAG = 0x2000_0000
_STANDARD_DIGITS = 3
_LINE = re.compile(
    r'\((?P<time>\d+\.\d+)\)\s+\S+\s+'
    r'(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#'
    r'(?:(?P<remote>[Rr])[0-8]?|(?P<data>(?:[0-9A-Fa-f]{2}\.?){0,8}))'
    r'(?:\s+[RT])?\s*'
)
_PLAYABLE = re.compile(r'[A-Za-z0-9_.-]{1,15}')  # names that a network interface can have
_STAND_IN = 'vcan0'


def log_channel(bus_name: str) -> str:
    """Return the name for the log: the bus's own when canplayer can play to it, else vcan0."""
    return bus_name if _PLAYABLE.fullmatch(bus_name) else _STAND_IN


def format_line(frame: Frame, timestamp: float, channel: str, *, sent: bool = False) -> str:
    """Return the line of a frame, with its direction and its end.

    Args:
        frame: A classic CAN frame.
        timestamp: Its time on the wall clock in [s].
        channel: Name of the bus, as of :func:`log_channel`.
        sent: It was sent by whoever writes, and not received.
    """
    can_id, data, _, is_extended, is_remote, is_error = frame
    if is_error:
        return f'({timestamp:.6f}) {channel} {can_id | _ERROR_FLAG:08X}#{data.hex().upper()}\n'
    identifier = f'{can_id:08X}' if is_extended else f'{can_id:03X}'
    content = 'R' if is_remote else data.hex().upper()
    return f'({timestamp:.6f}) {channel} {identifier}#{content} {"T" if sent else "R"}\n'


def read_lines(lines: Iterable[str]) -> Iterator[Frame]:
    """Read lines of candump; like canplayer it skips those that do not begin with a time.

    Raises:
        CodecError: A line is no classic CAN frame; the message has its number.
    """
    for number, line in enumerate(lines, start=1):
        if not line.startswith('('):
            continue
        try:
            yield parse_line(line)
        except CodecError as error:
            raise CodecError(f'line {number}: {error}') from error


def parse_line(line: str) -> Frame:
    """Read a line of candump.

    Raises:
        CodecError: It is no classic CAN frame in candump's format.
    """
    match = _LINE.fullmatch(line.strip())
    if match is None:
        raise CodecError(
            f'{line.strip()!r} is not a line such as `(1700000000.123456) can0 181#2706`'
        )
    digits = match['id']
    can_id = int(digits, 16)
    is_error = bool(can_id & _ERROR_FLAG) and len(digits) > _STANDARD_DIGITS
    frame = Frame(
        can_id & ~_ERROR_FLAG if is_error else can_id,
        bytes.fromhex((match['data'] or '').replace('.', '')),
        float(match['time']),
        is_extended=len(digits) > _STANDARD_DIGITS and not is_error,
        is_remote=match['remote'] is not None,
        is_error=is_error,
    )
    if not is_error:
        try:
            checked(frame)
        except ValueError as error:
            raise CodecError(f'{line.strip()!r}: {error}') from error
    return frame
