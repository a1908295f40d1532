# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Bus logs in formats that can-utils and other tools read.

The suffix of the file selects the format for writing:

- ``.asc``: Vector's text format (can-utils: asc2log)
- ``.blf``: Vector's binary format
- ``.log`` and all others: as ``candump -L`` writes it (can-utils: canplayer, log2asc; Wireshark)

The content selects the format for reading: those above, candump's screen output, PCAN's .trc, and
csv of SavvyCAN and python-can. python-can handles the formats that are not implemented here.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
import csv
from dataclasses import dataclass
import io
from pathlib import Path
import re
import struct
from typing import TextIO
import zlib

import can
from can.io.blf import BLFParseError

from ..exceptions import CodecError
from .adapter import from_message, to_message
from .candump_format import (
    format_line,
    log_channel,
    LOG_LINE,
    LoggedFrame,
    read_lines,
    read_screen,
    SCREEN_LINE,
)
from .frame import checked, Frame

_DAMAGE = (ValueError, LookupError, struct.error, zlib.error, BLFParseError)
_MICROSECOND = 1e-6  # [s]
_HEAD_SIZE = 1 << 16  # [byte] in which the format of a log shows
_ASC_TIME = re.compile(r'(?i)((?:date|begin triggerblock)\s.*:\d\d)\.(\d{1,2})(?=\s)')


class AscFile(io.TextIOWrapper):
    """Text of an .asc; corrects python-can's writer, which writes 7 ms of the start as ``.7``."""

    def readline(self, size: int = -1, /) -> str:  # type: ignore[override]  # as its base has it
        """Return the next line with three digits of milliseconds."""
        return _with_milliseconds(super().readline(size))

    def write(self, text: str) -> int:
        """Write with three digits of milliseconds."""
        return super().write(_with_milliseconds(text))


def _with_milliseconds(text: str) -> str:
    return _ASC_TIME.sub(lambda match: f'{match[1]}.{int(match[2]):03d}', text)


class LogWriter:
    """Writes frames to a log.

    Wall clock times are steady times plus the clock offset at the start, so times in the log stay
    continuous when the clock is set.
    """

    def __init__(self, path: Path, bus_name: str, wall_offset: float) -> None:
        """Open a file, its format by its suffix; wall_offset is wall minus steady clock in [s]."""
        suffix = path.suffix.lower()
        self._writer: can.ASCWriter | can.BLFWriter | None = None
        self._channel, self._offset = log_channel(bus_name), wall_offset
        if suffix == '.asc':
            self._writer = can.ASCWriter(AscFile(path.open('wb'), encoding='utf-8'))
        elif suffix == '.blf':
            self._writer = can.BLFWriter(path)
        elif suffix in {'.pcap', '.cap', '.pcapng'}:
            raise CodecError(f'{path}: no capture is written; name it .log, Wireshark opens those')
        else:
            self._text = path.open('w', encoding='ascii')

    def write(self, frames: Iterable[Frame]) -> None:
        """Write frames with their own time stamps."""
        for frame in frames:
            stamp = frame.timestamp + self._offset
            if self._writer is None:
                self._text.write(format_line(frame, stamp, self._channel))
            else:
                self._writer.on_message_received(to_message(frame, stamp))
        (self._text if self._writer is None else self._writer.file).flush()

    def close(self) -> None:
        """Write buffered frames, and close the file."""
        if self._writer is None:
            self._text.close()
        else:
            self._writer.stop()


@dataclass(frozen=True, slots=True)
class _TextFormat:
    """A text format."""

    name: str  # for messages
    begins: re.Pattern[str]  # what its first line that counts begins with
    # reads it; None where only its name is known
    read: Callable[[TextIO], Iterator[LoggedFrame]] | None = None


def read_log(path: Path, interface: str = '') -> Iterator[Frame]:
    """Yield the frames of one bus, with wall clock time stamps if the log has them.

    The format is detected from the content. An empty bus name selects the only bus of the log.

    Raises:
        CodecError: The log is damaged, has an unknown format, CAN FD frames, or frames of a
            second bus; the message names the format and the place.
        OSError: The log cannot be read.
    """
    first = ''
    for number, logged in enumerate(read_buses(path)):
        first = logged.interface if number == 0 else first
        if interface:
            if logged.interface == interface:
                yield logged.frame
        elif logged.interface != first:
            raise CodecError(f'{path} has frames of {first} and {logged.interface}; choose one')
        else:
            yield logged.frame


def read_buses(path: Path) -> Iterator[LoggedFrame]:
    """Yield the frames of all buses of a log.

    Raises:
        CodecError, OSError: See :func:`read_log`.
    """
    with path.open('rb') as file:
        head = file.read(_HEAD_SIZE)
    number, name = 0, ''
    try:
        name, frames = _opened(path, head)
        for logged in frames:
            yield logged
            number += 1
    except CodecError as error:
        raise CodecError(f'{path}: {name}: {error}' if name else f'{path}: {error}') from error
    except _DAMAGE as error:
        raise CodecError(f'{path}: {name}: damaged after {number} frames: {error}') from error


def _opened(path: Path, head: bytes) -> tuple[str, Iterator[LoggedFrame]]:
    """Return the name of the format of a log, and its frames."""
    for magic, name, reader in _BINARY:
        if head.startswith(magic):
            if reader is None:
                raise CodecError(f'{name} is not read; {_KNOWN}')
            return name, _read_binary(path, reader)
    encoding = 'utf-16' if head.startswith((b'\xff\xfe', b'\xfe\xff')) else 'utf-8-sig'
    lines = head.decode(encoding, 'replace').splitlines()
    for line in lines:
        for text_format in _TEXT:
            if not text_format.begins.match(line):
                continue
            if text_format.read is None:
                raise CodecError(f'{text_format.name} is not read; {_KNOWN}')
            file = AscFile(path.open('rb'), encoding=encoding, errors='replace')
            return text_format.name, _closing(file, text_format.read)
    first = next((line.strip() for line in lines if line.strip()), '')
    if not first:
        return '', iter(())  # a log of a silent bus
    raise CodecError(f'no log of a known format, it begins with {first[:60]!r}; {_KNOWN}')


def _read_binary(
    path: Path, reader: Callable[[Path], Iterable[can.Message]]
) -> Iterator[LoggedFrame]:
    """Open a binary log when its first frame is read, so that errors can name its format."""
    yield from _logged(reader(path), _name_of_channel)


def _closing(
    file: TextIO, read: Callable[[TextIO], Iterator[LoggedFrame]]
) -> Iterator[LoggedFrame]:
    with file:
        yield from read(file)


def _logged(
    messages: Iterable[can.Message], name: Callable[[can.Message], str] = lambda message: ''
) -> Iterator[LoggedFrame]:
    """Yield the frames of a python-can reader."""
    for message in messages:
        if message.is_fd:
            raise CodecError('it has CAN FD frames; only classic CAN is supported')
        frame = from_message(message, message.timestamp)
        yield LoggedFrame(name(message), frame if frame.is_error else checked(frame))


def _read_asc(file: TextIO) -> Iterator[LoggedFrame]:
    reader = can.ASCReader(file, relative_timestamp=False)
    elapsed = 0.0
    for logged in _logged(reader, _name_of_channel):
        time_stamp = logged.frame.timestamp
        if reader.timestamps_format == 'relative':  # to the line before
            elapsed += time_stamp - reader.start_time
            time_stamp = reader.start_time + elapsed
        yield logged._replace(frame=logged.frame._replace(timestamp=time_stamp))


def _channel(message: can.Message) -> str:
    return str(message.channel)


def _name_of_channel(message: can.Message) -> str:
    """Return the number of a channel as Vector counts it, from 1; empty without one."""
    return f'{message.channel + 1}' if isinstance(message.channel, int) else ''


def _read_savvycan(file: TextIO) -> Iterator[LoggedFrame]:
    """Read SavvyCAN's own csv, of GVRET: times in microseconds, identifiers in hexadecimal."""
    for row in csv.DictReader(file, skipinitialspace=True):
        length = int(row['LEN'])
        if length > _CLASSIC_MAX:
            raise CodecError('it has CAN FD frames; only classic CAN is supported')
        data = bytes(int(row[f'D{number}'], 16) for number in range(1, length + 1))
        is_extended = row['Extended'].strip().lower() in {'true', '1'}
        stamp = int(row['Time Stamp']) * _MICROSECOND
        frame = checked(Frame(int(row['ID'], 16), data, stamp, is_extended))
        yield LoggedFrame(row['Bus'].strip(), frame)


def _pattern(text: str) -> re.Pattern[str]:
    return re.compile(rf'\s*(?:{text})', re.IGNORECASE)


_CLASSIC_MAX = 8  # [byte]
_BINARY: tuple[tuple[bytes, str, Callable[[Path], Iterable[can.Message]] | None], ...] = (
    (b'LOGG', 'Vector .blf', can.BLFReader),
    (b'\xd4\xc3\xb2\xa1', 'pcap', None),  # of little-endian machines
    (b'\x0a\x0d\x0d\x0a', 'pcapng', None),
    (b'MDF ', 'ASAM MDF (.mf4)', None),
    (b'\x1f\x8b', 'a gzip file', None),
    (b'PK', 'a zip file', None),
)
_TEXT = (
    _TextFormat('Vector .asc', _pattern(r'date\s+\w+\s+\w|base\s+(?:hex|dec)\b'), _read_asc),
    _TextFormat('PCAN .trc', _pattern(';'), lambda file: _logged(can.TRCReader(file), _channel)),
    _TextFormat('SavvyCAN csv', _pattern('Time Stamp,ID,Extended'), _read_savvycan),
    _TextFormat(
        'python-can csv',
        _pattern('timestamp,arbitration_id,'),
        lambda file: _logged(can.CSVReader(file)),
    ),
    _TextFormat('BUSMASTER .log', _pattern(r'\*\*\*BUSMASTER')),
    _TextFormat('candump log', LOG_LINE, read_lines),
    _TextFormat("candump's screen", SCREEN_LINE, read_screen),
)
_KNOWN = (
    'read are candump (its logs and its screen), PCAN .trc, Vector .asc and .blf, csv of SavvyCAN '
    'and python-can; SavvyCAN converts others to its csv'
)
