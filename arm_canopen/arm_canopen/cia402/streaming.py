# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A stream of targets of one drive: stopped where it pauses, kept out where a command ended it."""

from __future__ import annotations

import math

from ..exceptions import DriveError
from ..master.events import Severity
from ..master.scheduler import Promise, Scheduler, Task
from .drive import Drive
from .sequences import DriveSequences
from .stop_sequence import STOP_TIMEOUT


class TargetStream:
    """Targets on a topic, without an end that anybody announces.

    A publisher cannot know that its drive was halted, homed or switched to a mode in which its
    numbers mean something else. So what comes after a command belongs to the old stream, until
    there was a pause of ``target_timeout``.
    """

    def __init__(self, drive: Drive, scheduler: Scheduler, steps: DriveSequences) -> None:
        self._drive = drive
        self._steps = steps
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

    def follow(self, delivery: Promise[None]) -> None:
        """A target was commanded: stop the drive when it refuses it, or no other one follows."""
        delivery.when_done(self._note_delivery)
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

    def _note_delivery(self, delivery: Promise[None]) -> None:
        drive = self._drive
        if delivery.error is None or self._ended_by or not drive.control.accepts_targets:
            return
        self.end('a target that the drive did not take')
        drive.control.hold()
        drive.warn(f'stopped: it has not taken a target of the stream ({delivery.error})')

    async def _watch_for_pause(self) -> None:
        while self._scheduler.now < self._goes_on_until:
            await self._scheduler.timer(self._goes_on_until - self._scheduler.now)
        drive = self._drive
        if not drive.control.accepts_targets:
            return  # what has taken it away has reported it
        paused = f'the stream of targets has paused for {drive.config.target_timeout * 1000:g} ms'
        if drive.control.mode.setpoint is not None and not drive.control.mode.cyclic:
            drive.warn(f'{paused}: it goes on to the last target, and rests there')
            return
        speed = drive.view.speed
        drive.control.hold()
        self._scheduler.background(self._report_rest(paused, speed))

    async def _report_rest(self, paused: str, speed: float) -> None:
        """Report the stop when the axis stands, not when the halt begins."""
        drive, steps = self._drive, self._steps
        timeout = STOP_TIMEOUT + speed / drive.view.parameters.profile.deceleration
        halted = drive.control.halt

        def ended() -> bool:
            stands = drive.control.mode.braked and drive.view.stands
            return stands or not drive.control.accepts_targets or not halted.held or halted.leaving

        await steps.settle()
        try:
            await self._scheduler.until(ended, timeout)
        except TimeoutError:
            drive.report(
                Severity.ERROR,
                f'{paused}: it was halted, but has not come to rest within {timeout:.1f} s and '
                f'moves at {drive.view.velocity:g} per second',
            )
            return
        if halted.held and not halted.leaving and drive.control.accepts_targets:
            drive.warn(f'{paused}: stopped; the next target goes on')
