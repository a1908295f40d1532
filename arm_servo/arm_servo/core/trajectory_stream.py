# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A stream of trajectories on a topic moves no arm that was stopped while it came."""

from __future__ import annotations

from collections.abc import Callable
import math
import threading

from ..exceptions import NotReadyError
from .hold_to_run import BEGINS, GONE_AFTER

TOGETHER = 1.0
"""Trajectories that follow each other within so many [s] are a stream; so long it has to be silent
before it can be let in again."""

ASK_TIMEOUT = 5.0
"""Longest time in [s] in which drives are got back for a trajectory that asked for them."""


class TrajectoryStream:
    """A stream on a topic whose senders are unknown; for any thread.

    A single trajectory is a request, and gets drives back. A stream was requested once, at its
    begin: what stops the arm from following ends it, and it stays out however it pauses, as a
    process that stalls makes pauses, too. It is let in again by :meth:`renew` while it is silent,
    or after :data:`.hold_to_run.GONE_AFTER`.
    """

    def __init__(self, clock: Callable[[], float]) -> None:
        self._clock = clock
        self._lock = threading.Lock()  # held for a few instructions only
        self._last = -math.inf
        self._asked = -math.inf
        self._is_stream = False
        self._barred = ''

    def take(self) -> None:
        """Record a trajectory.

        Raises:
            NotReadyError: It belongs to a stream that was ended.
        """
        now = self._clock()
        with self._lock:
            pause, self._last = now - self._last, now
            if pause > GONE_AFTER:
                self._is_stream, self._barred = False, ''
            elif pause <= TOGETHER:
                self._is_stream = True
            reason = self._barred
        if reason:
            raise NotReadyError(
                f'{reason}; a stream of trajectories does not go on after that: send none for'
                f' {TOGETHER:g} s, then an empty one, or none for {GONE_AFTER:g} s'
            )

    def ask(self, get_ready: Callable[[], bool]) -> None:
        """Get the drives back for a trajectory that was not refused.

        Args:
            get_ready: Gets them back; returns whether they were away.
        """
        self._asked = self._clock()  # first: the cycle may be quicker
        if not get_ready():
            self._asked = -math.inf

    def begin(self) -> bool:
        """The arm begins to follow; end a stream that did not ask for it.

        Returns:
            Whether one was ended.
        """
        asked, self._asked = self._asked, -math.inf
        return self._clock() - asked > ASK_TIMEOUT and self.interrupt(BEGINS)

    def interrupt(self, reason: str) -> bool:
        """End the stream.

        Returns:
            Whether there was one.
        """
        now = self._clock()
        with self._lock:
            goes_on = self._is_stream and now - self._last <= GONE_AFTER
            if goes_on:
                self._barred = self._barred or reason
            return goes_on

    def renew(self) -> None:
        """Treat the next trajectory as a new request, unless a stream is going on."""
        now = self._clock()
        with self._lock:
            if now - self._last > TOGETHER:
                self._last, self._is_stream, self._barred = -math.inf, False, ''
