# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Logs of a bus in formats that can-utils and other tools read, by the suffix of the file.

- ``.asc``: Vector's text format (can-utils: asc2log)
- ``.blf``: Vector's binary format
- ``.pcap``, ``.cap``: a capture for Wireshark, which knows CANopen
- ``.log`` and all others: as ``candump -L`` writes it (can-utils: canplayer, log2asc)

python-can writes all of them but captures, and reads the first two. What candump has written is
read here: python-can takes its error frames for data frames, and names no line where a log is
damaged.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
import re
import struct
import zlib

import can
from can.io.blf import BLFParseError

from arm_canopen.can.adapter import from_message, to_message
from arm_canopen.can.frame import checked, Frame
from arm_canopen.exceptions import CodecError

from .pcap import PcapReader, PcapWriter

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
_READERS: dict[str, type[can.ASCReader | can.BLFReader | PcapReader]] = {
    '.asc': can.ASCReader,
    '.blf': can.BLFReader,
    '.pcap': PcapReader,
    '.cap': PcapReader,
    '.pcapng': PcapReader,  # which says what to do
}
_DAMAGE = (ValueError, LookupError, struct.error, zlib.error, BLFParseError)


class LogWriter:
    """Writes frames to a log.

    Wall clock times are steady times plus the distance of the clocks at the start, so the log
    runs evenly also when somebody sets the clock.
    """

    def __init__(self, path: Path, bus_name: str, wall_offset: float) -> None:
        """Open a new file.

        Args:
            path: Where to; its suffix chooses the format.
            bus_name: Name of the bus; the log has a name that canplayer can play to.
            wall_offset: Wall clock minus steady clock in [s].
        """
        suffix = path.suffix.lower()
        self._candump = suffix not in _READERS
        self._writer: can.CanutilsLogWriter | can.ASCWriter | can.BLFWriter | PcapWriter
        if suffix == '.asc':
            self._writer = can.ASCWriter(path)
        elif suffix == '.blf':
            self._writer = can.BLFWriter(path)
        elif suffix == '.pcapng':
            raise CodecError(f'{path}: pcapng is not written; name it .pcap')
        elif suffix in {'.pcap', '.cap'}:
            self._writer = PcapWriter(path)
        else:
            self._writer = can.CanutilsLogWriter(path, channel=log_channel(bus_name))
        self._offset = wall_offset

    def write(self, frames: Iterable[Frame]) -> None:
        """Write frames with their own time stamps."""
        for frame in frames:
            if frame.is_error and self._candump:  # python-can would write the same for all errors
                frame = frame._replace(  # noqa: PLW2901
                    can_id=frame.can_id | _ERROR_FLAG, is_extended=True, is_error=False
                )
            self._writer.on_message_received(to_message(frame, frame.timestamp + self._offset))
        self._writer.file.flush()

    def close(self) -> None:
        """Write what is left, and close the file."""
        self._writer.stop()


def log_channel(bus_name: str) -> str:
    """Return the name for the log: the bus's own when canplayer can play to it, else vcan0."""
    return bus_name if _PLAYABLE.fullmatch(bus_name) else _STAND_IN


def read_log(path: Path) -> Iterator[Frame]:
    """Yield the frames of a log; their time stamps are on the wall clock.

    Raises:
        CodecError: The log is damaged or has CAN FD frames; the message names the place.
        OSError: It cannot be read.
    """
    reader = _READERS.get(path.suffix.lower())
    if reader is not None:
        yield from _read_messages(path, reader)
        return
    with path.open(encoding='ascii', errors='replace') as file:
        yield from read_lines(file)


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


def _read_messages(
    path: Path, reader: type[can.ASCReader | can.BLFReader | PcapReader]
) -> Iterator[Frame]:
    number = 0
    try:
        for message in reader(path, relative_timestamp=False):
            if message.is_fd:
                raise CodecError(f'frame {number + 1}: CAN FD frames are not supported')
            yield from_message(message, message.timestamp)
            number += 1
    except _DAMAGE as error:
        raise CodecError(f'{path}: damaged after {number} frames: {error}') from error
