# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A stream of targets of one drive: stopped where it pauses, kept out after a command."""

from __future__ import annotations

import math

from canopen_core import DriveError

from ..master.events import Severity
from ..master.scheduler import Promise, Scheduler, Task
from .drive import Drive
from .sequences import DriveSequences
from .stop_sequence import STOP_TIMEOUT


class TargetStream:
    """Targets on a topic, without an end that anybody announces.

    A publisher cannot know that its drive was halted, homed or switched to a mode in which its
    numbers mean something else, and a pause of it is no request: a stalled process and a network
    make pauses, too. So a stream that a command has ended stays out, until a command that enables
    the drive or selects a mode is given while no targets come.
    """

    def __init__(self, drive: Drive, scheduler: Scheduler, steps: DriveSequences) -> None:
        self._drive = drive
        self._steps = steps
        self._scheduler = scheduler
        self._came = -math.inf
        self._goes_on_until = 0.0
        self._ended_by = ''
        self._begun = False  # one has come since the last command that lets one in
        self._watch: Task[None] | None = None

    def admit(self) -> None:
        """Record a target of a stream."""
        self._came = self._scheduler.now
        if self._ended_by:
            raise DriveError(
                f'{self._drive.name} takes no stream of targets: it was ended by {self._ended_by};'
                ' stop the publisher, call ~/enable or the service of a mode, then stream anew'
            )
        self._begun = True

    def follow(self, delivery: Promise[None]) -> None:
        """A target was commanded: stop the drive when it refuses it, or no other one follows."""
        delivery.when_done(self._note_delivery)
        self._goes_on_until = self._scheduler.now + self._drive.config.target_timeout
        if self._watch is None or self._watch.done:
            self._watch = self._scheduler.background(self._watch_for_pause())

    def end(self, by: str) -> None:
        """Keep streams out, because of a command in words."""
        self._ended_by = by
        if self._watch is not None:
            self._watch.cancel(DriveError('the stream was ended by a command'))

    def interrupt(self, by: str) -> None:
        """Keep out the stream that has begun, if one has; a pause may be a stall."""
        if self._begun:
            self.end(by)

    def renew(self, by: str) -> None:
        """Admit a stream that begins from now on, but not one that comes already."""
        silence = self._scheduler.now - self._came
        if silence <= self._drive.config.target_timeout:
            self.end(by)
        else:
            self._ended_by, self._begun = '', False

    def _note_delivery(self, delivery: Promise[None]) -> None:
        drive = self._drive
        if delivery.error is None or self._ended_by or not drive.control.accepts_targets:
            return
        self.end('a target that the drive did not take')
        drive.control.hold()
        drive.warn(f'stopping: it has not taken a target of the stream ({delivery.error})')

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
