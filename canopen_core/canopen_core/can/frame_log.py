# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Logs of a bus as ``candump -L`` writes them (can-utils: canplayer, log2asc; Wireshark).

python-can's ``can_logconvert`` makes them of other formats (.asc, .blf, .trc, .csv), and others
of them.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from ..exceptions import CodecError
from .candump_format import format_line, log_channel, LoggedFrame, read_lines
from .frame import Frame

_OTHERS = {'.asc', '.blf', '.cap', '.csv', '.mf4', '.pcap', '.pcapng', '.trc'}
_CONVERT = 'convert it by python-can: can_logconvert'


class LogWriter:
    """Writes frames to a log.

    Wall clock times are steady times plus the distance of the clocks at the start, so the log
    runs evenly also when somebody sets the clock.
    """

    def __init__(self, path: Path, bus_name: str, wall_offset: float) -> None:
        """Open a file; wall_offset is wall minus steady clock in [s].

        Raises:
            CodecError: The suffix is that of another format.
        """
        if path.suffix.lower() in _OTHERS:
            own = path.with_suffix('.log')
            raise CodecError(
                f'{path}: logs are written as candump writes them; name it {own.name}, which '
                f'Wireshark opens, and {_CONVERT} {own.name} {path.name}'
            )
        self._channel, self._offset = log_channel(bus_name), wall_offset
        self._text = path.open('w', encoding='ascii')

    def write(self, frames: Iterable[Frame]) -> None:
        """Write frames with their own time stamps."""
        for frame in frames:
            line = format_line(frame, frame.timestamp + self._offset, self._channel)
            self._text.write(line)
        self._text.flush()

    def close(self) -> None:
        """Close the file."""
        self._text.close()


def read_log(path: Path, interface: str = '') -> Iterator[Frame]:
    """Yield the frames of one bus; their time stamps are on the wall clock.

    The log names its bus; empty means the only one.

    Raises:
        CodecError: The log is damaged, of another format, has CAN FD frames, or those of another
            bus besides; the message names the line.
        OSError: It cannot be read.
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
        CodecError, OSError: As of :func:`read_log`.
    """
    number = 0
    try:
        with path.open(encoding='utf-8', errors='replace') as file:
            for logged in read_lines(file):
                yield logged
                number += 1
    except CodecError as error:
        raise CodecError(f'{path}: {error}') from error
    if not number and (first := _first_line(path)):
        raise CodecError(
            f'{path}: no log of candump, it begins with {first[:60]!r}; {_CONVERT} {path.name} '
            f'{path.stem}_candump.log'
        )


def _first_line(path: Path) -> str:
    with path.open(encoding='utf-8', errors='replace') as file:
        return next((line.strip() for line in file if line.strip()), '')
