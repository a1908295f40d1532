# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Text formats of can-utils' ``candump``: its logs (``-L``, ``-l``) and its screen output.

python-can reads error frames of such logs as data frames, and writes all of them alike.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from datetime import datetime
from itertools import accumulate, pairwise
import re
from typing import NamedTuple

from ..exceptions import CodecError
from .frame import checked, Frame

_ERROR_FLAG = 0x2000_0000
_STANDARD_DIGITS = 3
LOG_LINE = re.compile(r'\(\d+\.\d+\)\s+\S+\s+[0-9A-Fa-f]+#')
"""Beginning of a line of a log."""
_LINE = re.compile(
    r'\((?P<time>\d+\.\d+)\)\s+(?P<interface>\S+)\s+'
    r'(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})#'
    r'(?:[Rr](?P<remote>[0-8]?)|(?P<data>(?:[0-9A-Fa-f]{2}\.?){0,8}))'
    r'(?:\s+[RT])?\s*'
)
SCREEN_LINE = re.compile(
    r'\s*(?:\((?P<time>[-\d:. ]+)\)\s+)?(?P<interface>\S+)\s+'
    r'(?:[RT]X\s+\S\s+\S\s+)?'  # direction and flags of CAN FD: candump -x
    r'(?P<id>[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8})\s+\[(?P<length>\d+)\]'
)
"""Beginning of a line of the screen output."""
_BYTES = re.compile(
    r'(?:\s+([0-9A-Fa-f]{2}(?:\s[0-9A-Fa-f]{2})*))?(?:\s+(?:\'.*\'|ERRORFRAME))?\s*'
)
_COLOR = re.compile(r'\x1b\[[0-9;]*m')
_PLAYABLE = re.compile(r'[A-Za-z0-9_.-]{1,15}')  # names that a network interface can have
_STAND_IN = 'vcan0'


class LoggedFrame(NamedTuple):
    """A frame of a log."""

    interface: str  # name of its bus, as the log has it; empty where it has none
    frame: Frame  # the frame; its time stamp is on the wall clock, or what the log counts from


def log_channel(bus_name: str) -> str:
    """Return the bus name for the log: its own if canplayer can replay to it, else vcan0."""
    return bus_name if _PLAYABLE.fullmatch(bus_name) else _STAND_IN


def format_line(frame: Frame, timestamp: float, channel: str, *, sent: bool = False) -> str:
    """Format a frame as a log line with wall clock time in [s], direction and line end."""
    can_id, data, _, is_extended, is_remote, is_error, remote_length = frame
    if is_error:
        return f'({timestamp:.6f}) {channel} {can_id | _ERROR_FLAG:08X}#{data.hex().upper()}\n'
    identifier = f'{can_id:08X}' if is_extended else f'{can_id:03X}'
    content = f'R{remote_length or ""}' if is_remote else data.hex().upper()
    return f'({timestamp:.6f}) {channel} {identifier}#{content} {"T" if sent else "R"}\n'


def read_lines(lines: Iterable[str]) -> Iterator[LoggedFrame]:
    """Read lines of a log; like canplayer, skip lines that do not begin with a time.

    Raises:
        CodecError: A line is not a classic CAN frame; the message has the line number.
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
        CodecError: The line is not a classic CAN frame in candump's format.
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


def read_screen(lines: Iterable[str]) -> Iterator[LoggedFrame]:
    """Read screen output of candump, with or without times; skip other lines.

    Raises:
        CodecError: A line is not a classic CAN frame; the message has the line number.
    """
    found: list[LoggedFrame] = []
    for number, line in enumerate(lines, start=1):
        text = _COLOR.sub('', line).rstrip()
        match = SCREEN_LINE.match(text)
        if match is None:
            continue
        try:
            found.append(_shown(match, text[match.end() :]))
        except CodecError as error:
            raise CodecError(f'line {number}: {text.strip()!r} {error}') from error
    times = [logged.frame.timestamp for logged in found]
    if any(later < before for before, later in pairwise(times)):  # candump -t d: since the last
        times = list(accumulate(times))
    for logged, time in zip(found, times, strict=True):
        yield logged._replace(frame=logged.frame._replace(timestamp=time))


def _shown(match: re.Match[str], content: str) -> LoggedFrame:
    length, remote = int(match['length']), None
    if len(match['length']) > 1:  # two digits, as candump prints them
        raise CodecError('is a CAN FD frame; only classic CAN is supported')
    if content.strip().startswith('remote request'):
        content, remote = '', length
    shown = _BYTES.fullmatch(content)
    data = bytes.fromhex(shown[1] or '') if shown is not None else b''
    if shown is None or len(data) != (0 if remote is not None else length):
        raise CodecError(f'has no {length} bytes in hexadecimal')
    return _logged(match['interface'], match['id'], data, remote, _seconds(match['time']))


def _seconds(time: str | None) -> float:
    """Return a screen time in [s]: since 1970, the start or the last frame, or local time."""
    if time is None:
        return 0.0
    try:
        return float(time) if '-' not in time else datetime.fromisoformat(time).timestamp()
    except ValueError as error:
        raise CodecError(f'has the time {time!r}') from error


def _logged(
    interface: str, digits: str, data: bytes, remote: int | None, timestamp: float
) -> LoggedFrame:
    """Build a frame from its parts; a remote frame has the requested length."""
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
