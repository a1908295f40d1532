# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Serial logs: in-memory recording, log files, their reader, and the faults that trigger them.

A log is written continuously, or from memory after a fault. It has lines of text, each with a
wall-clock time in [s]::

    # serial log of quad_hardware, version 1: < is from the robot, > to it
    (1764144123.000102) open {"port": "/dev/ttyAMA0", "baud": 2000000, "protocol": "v2", ...}
    (1764144123.000214) state {"state": "waiting", "detail": "L-2.0.0 on /dev/ttyAMA0 speaks ..."}
    (1764144123.000391) > 55 00 0a 01 ...
    (1764144123.021776) < 55 00 ...

A line holds the bytes of one read or write call, not a frame. Lines without a time are comments.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from heapq import merge
from itertools import islice
import json
import logging
import math
from operator import attrgetter, itemgetter
from pathlib import Path
from queue import SimpleQueue
import re
import threading
import time
from typing import TypeAlias

from black_box import Pause
from quad_description import MAX_TILT, RobotState

from .exceptions import RecordingError
from .link import LinkState
from .protocol import Fault, Model
from .report import BoardWatch, Confirmed, FAULT_TEXTS, Report

CLOSE_TIMEOUT = 10.0  # [s] for what is still to be written when the program ends
LOG = 'serial.log'
EVENTS = 1000  # changes of the link that are kept at most; in a minute there are some dozens
_CHUNK = 32  # lines that are written at once
_log = logging.getLogger(__name__)


HEADER = '# serial log of quad_hardware, version 1: < is from the robot, > to it\n'
RECEIVED, SENT = '<', '>'
_LINE = re.compile(r'\((\d+\.\d+)\) (<|>|open|state) (.*)')


@dataclass(frozen=True, slots=True)
class Transfer:
    """Bytes of one read or write call."""

    time: float  # when [s]
    data: bytes  # the bytes
    sent: bool  # they went to the robot; otherwise they came from it


@dataclass(frozen=True, slots=True)
class Opened:
    """A robot was found; its session follows."""

    time: float  # when [s]
    port: str  # device file
    baud: int  # speed [bit/s]
    protocol: str  # name of what it speaks
    firmware: str  # its version
    model: Model | None  # whose ranges scale bytes in protocol v1; None in others


@dataclass(frozen=True, slots=True)
class StateEntered:
    """The link entered a state."""

    time: float  # when [s]
    state: LinkState  # what the driver does from then on
    detail: str  # in words


Event: TypeAlias = Opened | StateEntered
Entry: TypeAlias = Transfer | Opened | StateEntered


def format_transfer(time: float, data: bytes, *, sent: bool) -> str:
    """Format a transfer as a line with its newline."""
    return f'({time:.6f}) {SENT if sent else RECEIVED} {data.hex(" ")}\n'


def format_event(event: Event, time: float) -> str:
    """Format an event as a line with its newline; the time is wall-clock [s]."""
    kind = 'state' if isinstance(event, StateEntered) else 'open'
    content = asdict(event)
    del content['time']
    text = json.dumps(content, ensure_ascii=False, default=attrgetter('value'))
    return f'({time:.6f}) {kind} {text}\n'


def read_serial_log(path: Path) -> Iterator[Entry]:
    """Yield the entries of a log, with wall-clock times.

    Raises:
        RecordingError: A line is damaged; the message has its number.
        OSError: The log cannot be read.
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


class SerialLogFile:
    """Writes all traffic of a line to a file; a full disk ends only the log."""

    def __init__(self, path: Path) -> None:
        """Open a new file.

        Raises:
            RecordingError: The file exists already or cannot be created.
        """
        self._path = path
        self._lines: SimpleQueue[str | None] = SimpleQueue()
        self._ended = False  # no line is taken out of the queue any more
        # one offset for all: the log runs evenly also when the clock is set
        self._offset = time.time() - time.monotonic()
        try:
            self._file = path.open('x', buffering=1, encoding='utf-8')  # by line
        except FileExistsError as error:
            raise RecordingError(f'{path} exists; choose another name for the log') from error
        except OSError as error:
            raise RecordingError(f'{path} cannot be written: {error.strerror}') from error
        self._file.write(HEADER)
        self._thread = threading.Thread(target=self._run, name='serial log', daemon=True)
        self._thread.start()

    def transfer(self, now: float, data: bytes, sent: bool) -> None:
        """Record bytes that were read or written."""
        if not self._ended:
            self._lines.put(format_transfer(now + self._offset, data, sent=sent))

    def event(self, event: Event) -> None:
        """Record a robot that was found, or a change of the link state."""
        if not self._ended:
            self._lines.put(format_event(event, event.time + self._offset))

    def close(self) -> None:
        """Flush and close the file; never raises."""
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
                for line in iter(self._lines.get, None):
                    file.write(line)
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


class SerialMemory:
    """Keeps recent transfers and link states in memory.

    Entries are tuples of plain values, which the garbage collector does not track. One thread
    records while another may save, without locks.
    """

    def __init__(self, port: str, window: float) -> None:
        """Start empty; the window is the time span to keep [s]."""
        self._port, self._window = port, window
        self._transfers: deque[tuple[float, bytes, bool]] = deque()
        self._events: deque[Event] = deque(maxlen=EVENTS)

    def transfer(self, now: float, data: bytes, sent: bool) -> None:
        """Add a transfer, and drop those older than the window."""
        transfers = self._transfers
        transfers.append((now, data, sent))
        begin = now - self._window
        while transfers[0][0] < begin:
            transfers.popleft()

    def event(self, event: Event) -> None:
        """Add a robot that was found, or a change of the link state."""
        self._events.append(event)

    @property
    def size(self) -> int:
        """Number of stored bytes of the line."""
        return sum(len(data) for _, data, _ in tuple(self._transfers))

    @property
    def about(self) -> str:
        """Port and extent of the stored data."""
        robot = 'no robot was found'
        for opened in tuple(self._events):
            if isinstance(opened, Opened):
                robot = (
                    f'robot: {opened.firmware}, protocol {opened.protocol} at {opened.baud} baud'
                )
        return (
            f'black box of the serial port {self._port}: the last {self._window:g} s, in {LOG}\n'
            f'{robot}'
        )

    def save(self, folder: Path, pause: Pause) -> Path:
        """Write the window's entries in chronological order.

        The log starts with the robot found earlier and the link state at that time.

        Args:
            pause: Called after each small piece of work.

        Raises:
            OSError: The file cannot be written.
        """
        now = time.monotonic()
        offset, begin = time.time() - now, now - self._window
        transfers, events = tuple(self._transfers), tuple(self._events)  # each in one step
        lines = merge(
            (
                (at, format_transfer(at + offset, data, sent=sent))
                for at, data, sent in transfers
                if at >= begin
            ),
            ((at, format_event(event, at + offset)) for at, event in _since(events, begin)),
            key=itemgetter(0),
        )
        path = folder / LOG
        with path.open('w', encoding='utf-8') as file:
            file.write(HEADER)
            while chunk := list(islice(lines, _CHUNK)):
                file.write(''.join(line for _, line in chunk))
                pause()
        return path

    def usage(self, path: Path) -> str:
        """Return commands that display the log."""
        return f'less {path}\nros2 run quad_hardware replay --ros-args -p log:={path}'


def _since(events: tuple[Event, ...], begin: float) -> list[tuple[float, Event]]:
    """Return later events with their times, and earlier ones still valid at the start."""
    last = {type(event): event for event in events if event.time < begin}
    held = sorted(last.values(), key=attrgetter('time'))
    later = [(event.time, event) for event in events if event.time >= begin]
    return [(begin, event) for event in held] + later


UPRIGHT = 0.8 * MAX_TILT  # [rad] below which a body that fell stands again
_LOST = {LinkState.STALE, LinkState.REFUSED, LinkState.FAILED}
_FOUND = {LinkState.WAITING, LinkState.RUNNING}


class FaultWatch:
    """Detects new faults between one report and the next."""

    def __init__(self) -> None:
        self._boards = BoardWatch()
        self._bits = Confirmed[Fault]()
        self._imu_problem = ''
        self._fallen = False

    def check(self, report: Report, state: RobotState) -> list[str]:
        """Return the new faults as text; usually empty."""
        begun: list[str] = []
        # without its clock a restart is a silence, which is a fault already
        if self._boards.restarted(report) and report.device_time is not None:
            begun.append('the board has begun anew; is the battery empty, or a plug loose?')
        before = self._bits.problems
        new = self._bits.take({bit for bit in Fault if bit & report.faults}) - before
        begun += [f'the robot reports {FAULT_TEXTS[bit]}' for bit in Fault if bit in new]
        if state.imu_problem and not self._imu_problem:
            begun.append(state.imu_problem)
        self._imu_problem = state.imu_problem
        if state.imu is not None:
            tilt = state.imu.tilt
            if tilt > MAX_TILT and not self._fallen:
                begun.append(f'the robot fell: its body is tilted by {math.degrees(tilt):.0f} deg')
            self._fallen = tilt > (UPRIGHT if self._fallen else MAX_TILT)
        return begun


class LossWatch:
    """Distinguishes the loss of a connected robot from the search for one."""

    def __init__(self) -> None:
        self._found = False

    def is_lost(self, state: LinkState) -> bool:
        """Record a new link state; return whether it means a fault."""
        was_found = self._found
        if state in _FOUND or state in {LinkState.CONNECTING, LinkState.STOPPED}:
            self._found = state in _FOUND
        return state in _LOST or (was_found and state is LinkState.CONNECTING)
