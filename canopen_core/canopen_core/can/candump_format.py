# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can-utils' ``candump`` writes: lines of its logs (``-L``, ``-l``).

python-can takes error frames of such a log for data frames, and writes the same for all of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import re
from typing import NamedTuple

from ..exceptions import CodecError
from .frame import checked, Frame

_ERROR_FLAG = 0x2000_0000
_STANDARD_DIGITS = 3
_LINE = re.compile(r'\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]+#')
"""How a line of a log begins."""
_LINE = re.compile(
    r'\((?P<time>\d+\.\d+)\)\s+(?P<interface>\S+)\s+'
    r'(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#'
    r'(?:[Rr](?P<remote>[0-8]?)|(?P<data>(?:[0-9A-Fa-f]{2}\.?){0,8}))'
    r'(?:\s+[RT])?\s*'
)
_PLAYABLE = re.compile(r'[A-Za-z0-9_.-]{1,15}')  # names that a network interface can have
_STAND_IN = 'vcan0'


class LoggedFrame(NamedTuple):
    """A frame of a log."""

    interface: str  # name of its bus, as the log has it; empty where it has none
    frame: Frame  # the frame; its time stamp is on the wall clock, or what the log counts from


def log_channel(bus_name: str) -> str:
    """Return the name for the log: the bus's own when canplayer can play to it, else vcan0."""
    return bus_name if _PLAYABLE.fullmatch(bus_name) else _STAND_IN


def format_line(frame: Frame, timestamp: float, channel: str, *, sent: bool = False) -> str:
    """Return the line of a frame, with its wall clock time in [s], its direction and its end."""
    can_id, data, _, is_extended, is_remote, is_error, remote_length = frame
    if is_error:
        return f'({timestamp:.6f}) {channel} {can_id | _ERROR_FLAG:08X}#{data.hex().upper()}\n'
    identifier = f'{can_id:08X}' if is_extended else f'{can_id:03X}'
    content = f'R{remote_length or ""}' if is_remote else data.hex().upper()
    return f'({timestamp:.6f}) {channel} {identifier}#{content} {"T" if sent else "R"}\n'


def read_lines(lines: Iterable[str]) -> Iterator[LoggedFrame]:
    """Read lines of a log; like canplayer it skips those that do not begin with a time.

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


def parse_line(line: str) -> LoggedFrame:
    """Read a line of a log.

    Raises:
        CodecError: It is no classic CAN frame in candump's format.
    """
    match = _LINE.fullmatch(line.strip())
    if match is None:
        what = 'is not a line such as `(1700000000.123456) can0 181#2706`'
        if '##' in line:
            what = 'is a CAN FD frame; only classic CAN is supported'
        raise CodecError(f'{line.strip()!r} {what}')
    data = bytes.fromhex((match['data'] or '').replace('.', ''))
    remote = None if match['remote'] is None else int(match['remote'] or 0)
    return _logged(match['interface'], match['id'], data, remote, float(match['time']))


def _logged(
    interface: str, digits: str, data: bytes, remote: int | None, timestamp: float
) -> LoggedFrame:
    """Return a frame of its parts; of a remote request with the length that it asks for."""
    can_id = int(digits, 16)
    has_long_id = len(digits) > _STANDARD_DIGITS
    is_error = bool(can_id & _ERROR_FLAG) and has_long_id
    frame = Frame(
        can_id & ~_ERROR_FLAG if is_error else can_id,
        data,
        timestamp,
        is_extended=has_long_id and not is_error,
        is_remote=remote is not None,
        is_error=is_error,
        remote_length=remote or 0,
    )
    if not is_error:
        try:
            checked(frame)
        except ValueError as error:
            raise CodecError(str(error)) from error
    return LoggedFrame(interface, frame)
