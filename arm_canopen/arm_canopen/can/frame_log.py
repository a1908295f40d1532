# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Logs of a bus in formats that can-utils and other tools read, by the suffix of the file.

- ``.asc``: Vector's text format (can-utils: asc2log)
- ``.blf``: Vector's binary format
- ``.pcap``, ``.cap``: a capture for Wireshark, which knows CANopen
- ``.log`` and all others: as ``candump -L`` writes it (can-utils: canplayer, log2asc)

python-can writes and reads the first two; the others are written and read here.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
import struct
import zlib

import can
from can.io.blf import BLFParseError

from ..exceptions import CodecError
from .adapter import from_message, to_message
from .candump_format import format_line, log_channel, read_lines
from .frame import Frame
from .pcap import PcapReader, PcapWriter

_READERS: dict[str, type[can.ASCReader | can.BLFReader | PcapReader]] = {
    '.asc': can.ASCReader,
    '.blf': can.BLFReader,
    '.pcap': PcapReader,
    '.cap': PcapReader,
    '.pcapng': PcapReader,  # which says what to do
}
_DAMAGE = (ValueError, LookupError, struct.error, zlib.error, BLFParseError)


class CandumpWriter:
    """Writes lines of candump.

    Attributes:
        file: What is written.
    """

    def __init__(self, path: Path, channel: str) -> None:
        """Open a new file.

        Args:
            path: Where to.
            channel: Name of the bus, as of :func:`.log_channel`.
        """
        self.file = path.open('w', encoding='ascii')
        self._channel = channel

    def on_message_received(self, message: can.Message) -> None:
        """Write a classic CAN frame."""
        frame = from_message(message, message.timestamp)
        self.file.write(format_line(frame, message.timestamp, self._channel))

    def stop(self) -> None:
        """Close the file."""
        self.file.close()


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
        self._writer: CandumpWriter | can.ASCWriter | can.BLFWriter | PcapWriter
        if suffix == '.asc':
            self._writer = can.ASCWriter(path)
        elif suffix == '.blf':
            self._writer = can.BLFWriter(path)
        elif suffix == '.pcapng':
            raise CodecError(f'{path}: pcapng is not written; name it .pcap')
        elif suffix in {'.pcap', '.cap'}:
            self._writer = PcapWriter(path)
        else:
            self._writer = CandumpWriter(path, log_channel(bus_name))
        self._offset = wall_offset

    def write(self, frames: Iterable[Frame]) -> None:
        """Write frames with their own time stamps."""
        for frame in frames:
            self._writer.on_message_received(to_message(frame, frame.timestamp + self._offset))
        self._writer.file.flush()

    def close(self) -> None:
        """Write what is left, and close the file."""
        self._writer.stop()


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
