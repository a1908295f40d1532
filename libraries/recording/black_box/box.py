# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Writes the data in memory to a folder, some seconds after a fault, and replays such logs."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass
import logging
import os
from pathlib import Path
from queue import Empty, SimpleQueue
import re
import shutil
from textwrap import indent
import threading
import time
from typing import Generic, Protocol, TypeAlias, TypeVar

WINDOW = 60.0  # [s]
WINDOW_MAX = 600.0  # [s] longer, and a recording is the better tool
FOLDER = 'black_box'
PAUSE_SHARE = 0.75  # of the window


@dataclass(frozen=True, slots=True)
class BlackBoxSettings:
    """Settings of a black box; times in [s]."""

    folder: Path  # folder of its recordings, made with the first one
    window: float = WINDOW  # how far back a recording reaches
    # delay from the fault to the writing, so that the recording covers what follows
    after: float = 3.0
    kept: int = 20  # number of recordings in the folder; older ones are removed

    @property
    def pause(self) -> float:
        """Minimum time between two recordings, so that a repeated fault does not fill the disk.

        It is shorter than the window, so the next recording covers a fault during the pause.
        """
        return PAUSE_SHARE * self.window


def default_folder(environ: Mapping[str, str] = os.environ) -> Path:
    """Return the folder ``black_box`` in the log directory of ROS.

    As in rcl_logging, that is ROS_LOG_DIR, else ``log`` in ROS_HOME, else ``~/.ros/log``.
    """
    if logs := environ.get('ROS_LOG_DIR'):
        return Path(logs).expanduser() / FOLDER
    home = environ.get('ROS_HOME') or '~/.ros'
    return Path(home).expanduser() / 'log' / FOLDER


REPORT = 'report.txt'
NOTES = 2000  # lines of what was reported that are kept at most
BREATH = 1e-3  # [s] in which other threads get the interpreter
CLOSE_TIMEOUT = 10.0  # [s] for what is still to be written when the program ends
_PARTIAL = '.partial'

logger = logging.getLogger(__name__)

Pause: TypeAlias = Callable[[], None]
"""Called after each small piece of work, to yield the interpreter to other threads."""


class Contents(Protocol):
    """The data that a black box holds, besides the reports."""

    @property
    def about(self) -> str:
        """Describe what was recorded, in one or more lines."""

    def save(self, folder: Path, pause: Pause) -> Path:
        """Write the recording, in the thread of the black box; return its main file.

        Raises:
            OSError: The recording cannot be written.
        """

    def usage(self, path: Path) -> str:
        """Return the commands that show that file, one per line."""


@dataclass(frozen=True, slots=True)
class _Note:
    """A report, with its steady time in [s]."""

    time: float
    subject: str
    text: str

    @property
    def line(self) -> str:
        return f'{self.subject}: {self.text}' if self.subject else self.text


class BlackBox:
    """Writes one folder per fault, or per group of faults that occur together.

    Reporting a fault waits neither for the disk nor for a lock. A full disk, or a folder that
    cannot be created, only logs a warning.
    """

    def __init__(self, name: str, contents: Contents, settings: BlackBoxSettings) -> None:
        """Write nothing before :meth:`start`; folder names contain ``name``."""
        self.last: Path | None = None  # main file of the last recording; None before the first one
        self._name = re.sub(r'[^A-Za-z0-9.-]+', '_', name).strip('_.') or 'fault'
        self._contents = contents
        self._settings = settings
        self._notes: deque[_Note] = deque(maxlen=NOTES)
        self._by_subject: dict[str, Path] = {}
        self._faults: SimpleQueue[_Note | None] = SimpleQueue()
        self._written_at = -settings.pause
        self._closing = False
        self._thread = threading.Thread(target=self._run, name='black box', daemon=True)

    def start(self) -> None:
        """Start the thread that writes."""
        self._thread.start()

    def close(self) -> None:
        """Write pending recordings at once, and end the thread; never raises."""
        self._closing = True
        self._faults.put(None)
        if self._thread.is_alive():
            self._thread.join(CLOSE_TIMEOUT)

    def note(self, subject: str, text: str) -> None:
        """Keep a report for the recording of a later fault."""
        self._notes.append(_Note(time.monotonic(), subject, text))

    def fault(self, subject: str, text: str) -> None:
        """Request that a recording is written for a fault; does not wait for it."""
        note = _Note(time.monotonic(), subject, text)
        self._notes.append(note)
        self._faults.put(note)

    def recording_of(self, subject: str) -> Path | None:
        """Return the main file of the last recording of a device's fault; None without one."""
        return self._by_subject.get(subject)

    def _run(self) -> None:
        while (fault := self._faults.get()) is not None:
            faults = [fault]
            due = max(fault.time + self._settings.after, self._written_at + self._settings.pause)
            ended = self._collect(faults, due)
            try:
                self._write(faults)
            except OSError as error:
                logger.warning(
                    'the black box cannot be written to %s: %s; the fault was: %s. Make room, or '
                    'choose another folder by the parameter black_box_folder',
                    self._settings.folder,
                    error,
                    fault.line,
                )
            except Exception:
                logger.exception('a defect in the black box of %s', self._name)
            self._written_at = time.monotonic()
            if ended:
                return

    def _collect(self, faults: list[_Note], due: float) -> bool:
        """Collect faults until a recording is due; return True if it is the last one."""
        while (left := due - time.monotonic()) > 0.0:
            try:
                fault = self._faults.get(timeout=left)
            except Empty:
                return False
            if fault is None:
                return True
            faults.append(fault)
        return False

    def _write(self, faults: list[_Note]) -> None:
        settings = self._settings
        settings.folder.mkdir(parents=True, exist_ok=True)
        now = time.time()
        stamp = time.strftime('%Y-%m-%dT%H-%M-%S', time.localtime(now))
        final = _unused(settings.folder / f'{self._name}_{stamp}.{int(now % 1.0 * 1000):03d}')
        partial = settings.folder / f'{final.name}{_PARTIAL}'
        try:
            partial.mkdir()
            main = self._contents.save(partial, self._pause)
            opened = final / main.name
            (partial / REPORT).write_text(self._report(faults, opened), encoding='utf-8')
            partial.rename(final)
        except BaseException:
            shutil.rmtree(partial, ignore_errors=True)
            raise
        self.last = opened
        for fault in faults:
            if fault.subject:
                self._by_subject[fault.subject] = opened
        more = f', and {len(faults) - 1} more' if len(faults) > 1 else ''
        logger.warning('black box: %s (%s%s)', opened, faults[0].line, more)
        self._remove_old(final)

    def _pause(self) -> None:
        if not self._closing:  # then no cycle needs the interpreter any more
            time.sleep(BREATH)

    def _report(self, faults: list[_Note], opened: Path) -> str:
        begin = faults[0].time - self._settings.window
        offset = time.time() - time.monotonic()
        lines = [self._contents.about, '', 'faults:']
        lines += [_line(fault, offset) for fault in faults]
        lines += ['', 'reported:']
        lines += [_line(note, offset) for note in tuple(self._notes) if note.time >= begin]
        lines += ['', 'to look at it:', indent(self._contents.usage(opened), '  '), '']
        return '\n'.join(lines)

    def _remove_old(self, newest: Path) -> None:
        """Remove the oldest recordings, and unfinished ones of a killed program."""
        own = re.compile(rf'{re.escape(self._name)}_\d{{4}}-\d\d-\d\dT[0-9-]{{8}}\.\d{{3}}(-\d+)?')
        found = [
            path
            for path in self._settings.folder.iterdir()
            if own.fullmatch(path.name.removesuffix(_PARTIAL)) and path != newest
        ]
        kept = self._settings.kept - 1
        for path in sorted(found, key=_age)[kept:]:
            shutil.rmtree(path, ignore_errors=True)


def _age(path: Path) -> float:
    with suppress(OSError):
        return -path.stat().st_mtime
    return 0.0


def _unused(path: Path) -> Path:
    """Return the path, with a number appended if it exists."""
    candidate, number = path, 1
    while candidate.exists():
        number += 1
        candidate = path.with_name(f'{path.name}-{number}')
    return candidate


def _line(note: _Note, offset: float) -> str:
    wall = note.time + offset
    clock = time.strftime('%Y-%m-%d %H:%M:%S', time.localtime(wall))
    return f'  {clock}.{int(wall % 1.0 * 1000):03d}  {note.line}'


WAIT_MIN = 1e-3  # [s] below which frames are not worth a wait
WAIT_MAX = 0.02  # [s] after which one looks what is missing
GAP = 0.1  # [s] between the last entry and the first one of the next turn

Entry = TypeVar('Entry')
Entry_contra = TypeVar('Entry_contra', contravariant=True)


class PlaybackError(ValueError):
    """A log has nothing to play: it is empty, or ends before the requested start."""


class Replay(Protocol[Entry_contra]):
    """Receives the entries of a log. Times are those of the log in [s] and never decrease."""

    def take(self, entry: Entry_contra, now: float) -> None:
        """Handle the next entry, which happened at ``now``."""

    def advance(self, now: float) -> None:
        """Advance the time to ``now`` without an entry."""

    def restart(self) -> None:
        """Reset the state, as the log begins again."""


class LogPlayer(Generic[Entry]):
    """Plays a log, once or in a loop."""

    def __init__(
        self,
        replay: Replay[Entry],
        read: Callable[[], Iterable[tuple[float, Entry]]],
        *,
        name: str,
        rate: float,
        start: float,
    ) -> None:
        """Prepare.

        Args:
            read: Yields the entries of the log with their times in [s], from the first one.
            name: Name of the log in errors: its file.
            rate: Seconds of the log played per second.
            start: Offset from its beginning in [s]; earlier entries are handled at once, so that
                states are known.
        """
        self.seeking = False  # whether the entries lie before the requested start
        # called in the thread of :meth:`play`, some ten times a second at least
        self.on_tick: Callable[[], None] = lambda: None
        self._replay = replay
        self._read = read
        self._name = name
        self._rate = rate
        self._start = start
        self._zero = 0.0  # steady time in [s] at which log time `_log_zero` is played
        self._log_zero = 0.0

    def steady(self, log_time: float) -> float:
        """Return the steady time at which a time of the log is played, both in [s]."""
        return self._zero + (log_time - self._log_zero) / self._rate

    def play(self, stop: threading.Event, *, loop: bool) -> None:
        """Play until the end or, with ``loop``, until stopped.

        Raises:
            PlaybackError: The log has no entries, or ends before the start.
        """
        shift = 0.0  # of the times of the log, so that they go on in the next turn
        while not stop.is_set():
            last = self._play_once(stop, shift)
            if not loop or stop.is_set():
                return
            shift = last + GAP
            self._replay.restart()

    def _play_once(self, stop: threading.Event, shift: float) -> float:
        """Play from the first entry, whose time is ``shift``; return the time of the last one."""
        first: float | None = None
        began = False
        now = shift
        for timestamp, entry in self._read():
            if first is None:
                first = timestamp
            at = timestamp - first
            now = max(now, at + shift)  # a log may have been put together, out of order
            if not began and at >= self._start:
                began = True
                self._log_zero, self._zero = now, time.monotonic()
            self.seeking = not began
            if began:
                self._wait(now, stop)
            if stop.is_set():
                break
            self._replay.take(entry, now)
        if not began and not stop.is_set():
            length = 0.0 if first is None else now - shift
            raise PlaybackError(
                f'{self._name}: nothing to play: the log has {length:.1f} s, and start is'
                f' {self._start:g} s; begin earlier'
                if first is not None
                else f'{self._name}: nothing to play: the log is empty, or no log; give another'
            )
        return now

    def _wait(self, log_time: float, stop: threading.Event) -> None:
        """Wait until a time of the log in [s]; advance the replay, so that it detects silence."""
        due = self.steady(log_time)
        while (left := due - time.monotonic()) > WAIT_MIN:
            if stop.wait(min(left, WAIT_MAX)):
                return
            played = self._log_zero + (time.monotonic() - self._zero) * self._rate
            self._replay.advance(min(played, log_time))
            self.on_tick()
        self.on_tick()
