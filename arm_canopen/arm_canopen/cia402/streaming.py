# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A stream of targets of one drive: stopped where it pauses, kept out where a command ended it."""

from __future__ import annotations

import math

from ..exceptions import DriveError
from ..master.events import Severity
from ..master.scheduler import Scheduler, Task
from .drive import Drive


class TargetStream:
    """Targets on a topic, without an end that anybody announces.

    A publisher cannot know that its drive was halted, homed or switched to a mode in which its
    numbers mean something else. So what comes after a command belongs to the old stream, until
    there was a pause of ``target_timeout``.
    """

    def __init__(self, drive: Drive, scheduler: Scheduler) -> None:
        """Take the drive and the time."""
        self._drive = drive
        self._scheduler = scheduler
        self._came = -math.inf
        self._goes_on_until = 0.0
        self._ended_by = ''
        self._watch: Task[None] | None = None

    def admit(self) -> None:
        """Take note of a target of a stream.

        Raises:
            DriveError: It belongs to a stream that was ended.
        """
        drive, now = self._drive, self._scheduler.now
        before, self._came = self._came, now
        if now - before > drive.config.target_timeout:
            self._ended_by = ''
        if self._ended_by:
            pause = drive.config.target_timeout * 1000  # [ms]
            raise DriveError(
                f'{drive.name} takes no target of this stream: it was ended by {self._ended_by}; '
                f'a new one begins after a pause of {pause:g} ms'
            )

    def follow(self) -> None:
        """A target was taken: stop the drive when no other one follows."""
        self._goes_on_until = self._scheduler.now + self._drive.config.target_timeout
        if self._watch is None or self._watch.done:
            self._watch = self._scheduler.background(self._watch_for_pause())

    def end(self, by: str) -> None:
        """Keep out what is still to come of the stream.

        Args:
            by: What ended it, in words.
        """
        self._ended_by = by
        if self._watch is not None:
            self._watch.cancel(DriveError('the stream was ended by a command'))

    async def _watch_for_pause(self) -> None:
        while self._scheduler.now < self._goes_on_until:
            await self._scheduler.timer(self._goes_on_until - self._scheduler.now)
        drive = self._drive
        if not drive.accepts_targets:
            return  # what has taken it away has said so
        if not drive.mode.halts_by_bit or drive.mode.setpoint is None:
            drive.hold()  # in mode 1 it goes to the last target, and rests there
        drive.report(
            Severity.WARNING,
            f'the stream of targets has paused for {drive.config.target_timeout * 1000:g} ms: '
            'stopped; the next target goes on',
        )
