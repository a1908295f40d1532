# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The log of a serial session: lines of text, each with its time on the wall clock in [s].

::

    # serial log of quad_hardware, version 1: < is from the robot, > to it
    (1764144123.000102) open {"port": "/dev/ttyAMA0", "baud": 2000000, "protocol": "v2", ...}
    (1764144123.000214) state {"state": "waiting", "detail": "L-2.0.0 on /dev/ttyAMA0 speaks ..."}
    (1764144123.000391) > 55 00 0a 01 ...
    (1764144123.021776) < 55 00 ...

A line is what one call has read or written, not a frame. Lines that do not begin with a time are
comments.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
import json
import logging
from pathlib import Path
from queue import Empty, SimpleQueue
import re
import threading
import time
from typing import TextIO, TypeAlias

from ..exceptions import RecordingError
from ..link import LinkState
from ..protocol import Model

FLUSH_PERIOD = 0.5  # [s] of which a program that is killed loses at most
CLOSE_TIMEOUT = 10.0  # [s] for what is still to be written when the program ends
_log = logging.getLogger(__name__)


class SerialLogFile:
    """Writes all that happens on a line. A disk that is full ends the log, and nothing else."""

    def __init__(self, path: Path) -> None:
        """Open a new file.

        Raises:
            RecordingError: There is one already, or it cannot be made.
        """
        self._path = path
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        self._ended = False  # nobody takes lines out of the queue any more
        # one offset for all: the log runs evenly also when somebody sets the clock
        self._offset = time.time() - time.monotonic()
        try:
            self._file = path.open('x', encoding='utf-8')
        except FileExistsError as error:
            raise RecordingError(f'{path} exists; choose another name for the log') from error
        except OSError as error:
            raise RecordingError(f'{path} cannot be written: {error.strerror}') from error
        self._file.write(HEADER)
        self._thread = threading.Thread(target=self._run, name='serial log', daemon=True)
        self._thread.start()

    def transfer(self, now: float, data: bytes, sent: bool) -> None:
        """Take bytes that were read, or written."""
        if not self._ended:
            self._lines.put(format_transfer(now + self._offset, data, sent=sent))

    def event(self, event: Opened | StateEntered) -> None:
        """Take a robot that was found, or a change of the link's state."""
        if not self._ended:
            self._lines.put(format_event(event, event.time + self._offset))

    def close(self) -> None:
        """Write what is left, and close the file; never raises."""
        if not self._ended:
            self._lines.put(None)
        self._thread.join(CLOSE_TIMEOUT)
        if self._thread.is_alive():
            _log.warning(
                '%s: the disk did not take the end of the serial log within %g s',
                self._path,
                CLOSE_TIMEOUT,
            )

    def _run(self) -> None:
        try:
            with self._file as file:
                self._write(file)
        except OSError as error:
            _log.warning(
                '%s: %s; the serial log ends here. Make room, or choose another disk by the '
                'parameter serial_log',
                self._path,
                error.strerror,
            )
        finally:
            self._ended = True
            while not self._lines.empty():
                self._lines.get()

    def _write(self, file: TextIO) -> None:
        while (line := self._lines.get()) is not None:
            file.write(line)
            flush_at = time.monotonic() + FLUSH_PERIOD
            while (left := flush_at - time.monotonic()) > 0.0:
                try:
                    more = self._lines.get(timeout=left)
                except Empty:
                    break
                if more is None:
                    return
                file.write(more)
            file.flush()


HEADER = '# serial log of quad_hardware, version 1: < is from the robot, > to it\n'
RECEIVED, SENT = '<', '>'
_LINE = re.compile(r'\((\d+\.\d+)\) (<|>|open|state) (.*)')


@dataclass(frozen=True, slots=True)
class Transfer:
    """Bytes that were read or written at once."""

    time: float  # when [s]
    data: bytes  # the bytes
    sent: bool  # they went to the robot; otherwise they came from it


@dataclass(frozen=True, slots=True)
class Opened:
    """A robot that was found; what follows is the conversation with it."""

    time: float  # when [s]
    port: str  # device file
    baud: int  # speed [bit/s]
    protocol: str  # name of what it speaks
    firmware: str  # its version
    model: Model | None  # whose ranges scale bytes in protocol v1; None in others


@dataclass(frozen=True, slots=True)
class StateEntered:
    """The state of the link has changed."""

    time: float  # when [s]
    state: LinkState  # what the driver does from then on
    detail: str  # in words


Entry: TypeAlias = Transfer | Opened | StateEntered


def format_transfer(time: float, data: bytes, *, sent: bool) -> str:
    """Return the line of bytes, with its end."""
    return f'({time:.6f}) {SENT if sent else RECEIVED} {data.hex(" ")}\n'


def format_event(event: Opened | StateEntered, time: float) -> str:
    """Return the line of what is no transfer, with its end.

    Args:
        time: When, on the wall clock [s].
    """
    if isinstance(event, StateEntered):
        kind = 'state'
        content: dict[str, object] = {'state': event.state.value, 'detail': event.detail}
    else:
        kind = 'open'
        content = {
            'port': event.port,
            'baud': event.baud,
            'protocol': event.protocol,
            'firmware': event.firmware,
            'model': None if event.model is None else event.model.value,
        }
    return f'({time:.6f}) {kind} {json.dumps(content, ensure_ascii=False)}\n'


def read_serial_log(path: Path) -> Iterator[Entry]:
    """Yield what a log has; times are on the wall clock.

    Raises:
        RecordingError: A line is damaged; the message has its number.
        OSError: It cannot be read.
    """
    with path.open(encoding='utf-8', errors='replace') as file:
        for number, line in enumerate(file, start=1):
            if not line.startswith('('):
                continue
            try:
                yield _parse(line.rstrip('\r\n'))
            except (ValueError, KeyError, TypeError) as error:
                raise RecordingError(f'{path}, line {number} is damaged: {error}') from error


def _parse(line: str) -> Entry:
    found = _LINE.fullmatch(line)
    if found is None:
        raise ValueError(f'{line[:40]!r} is no entry of a serial log')
    time, kind, content = float(found[1]), found[2], found[3]
    if kind in {RECEIVED, SENT}:
        return Transfer(time, bytes.fromhex(content), kind == SENT)
    values = json.loads(content)
    if kind == 'state':
        return StateEntered(time, LinkState(values['state']), str(values['detail']))
    model = values['model']
    return Opened(
        time,
        str(values['port']),
        int(values['baud']),
        str(values['protocol']),
        str(values['firmware']),
        None if model is None else Model(model),
    )
