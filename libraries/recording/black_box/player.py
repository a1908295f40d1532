# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Plays the entries of a log to a replay at their original times."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import threading
import time
from typing import Generic, Protocol, TypeVar

WAIT_MIN = 1e-3  # [s] below which frames are not worth a wait
WAIT_MAX = 0.02  # [s] after which one looks what is missing
GAP = 0.1  # [s] between the last entry and the first one of the next turn

Entry = TypeVar('Entry')
Entry_contra = TypeVar('Entry_contra', contravariant=True)


class PlaybackError(ValueError):
    """A log has nothing to play: it is empty, or ends before the requested start."""


class Replay(Protocol[Entry_contra]):
    """The receiver of a log's entries. Times are those of the log in [s] and never go back."""

    def take(self, entry: Entry_contra, now: float) -> None:
        """Handle the next entry, which happened now."""

    def advance(self, now: float) -> None:
        """Advance the time; nothing happened meanwhile."""

    def restart(self) -> None:
        """Reset the state, as the log begins again."""


class LogPlayer(Generic[Entry]):
    """Plays a log, once or again and again.

    Attributes:
        seeking: Whether the entries lie before the requested start.
        on_tick: Called in the thread of :meth:`play`, some ten times a second at least.
    """

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
            replay: Gets the entries.
            read: Yields the entries of the log with their times in [s], from the first one.
            name: Name of the log in errors: its file.
            rate: Seconds of the log played per second.
            start: How far from its beginning it is played in time, in [s]; what comes before is
                taken at once, so that states are known.
        """
        self.seeking = False
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
        """Play until the end, or until stopped.

        Args:
            stop: Ends it.
            loop: Begin again at the end.

        Raises:
            PlaybackError: It has no entries, or ends before the start.
        """
        shift = 0.0  # of the times of the log, so that they go on in the next turn
        while not stop.is_set():
            last = self._play_once(stop, shift)
            if not loop or stop.is_set():
                return
            shift = last + GAP
            self._replay.restart()

    def _play_once(self, stop: threading.Event, shift: float) -> float:
        """Play it from its first frame, whose time is the shift; return the time of the last."""
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
        """Wait until a time of the log in [s]; meanwhile time passes for what is missing."""
        due = self.steady(log_time)
        while (left := due - time.monotonic()) > WAIT_MIN:
            if stop.wait(min(left, WAIT_MAX)):
                return
            played = self._log_zero + (time.monotonic() - self._zero) * self._rate
            self._replay.advance(min(played, log_time))
            self.on_tick()
        self.on_tick()
