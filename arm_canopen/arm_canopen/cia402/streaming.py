# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A stream of targets of one drive: stopped where it pauses, kept out after a command."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
import math
from typing import Any

from canopen_core import DriveError

from ..master.events import Severity
from ..master.scheduler import Promise, Scheduler, Task
from .axis import Axis
from .stop import STOP_TIMEOUT


class TargetStream:
    """Targets on a topic, without an end that anybody announces.

    A publisher cannot know that its drive was halted, homed or switched to a mode in which its
    numbers mean something else, and a pause of it is no request: a stalled process and a network
    make pauses, too. So a stream that a command has ended stays out, until a command that enables
    the drive or selects a mode is given while no targets come.
    """

    def __init__(
        self,
        axis: Axis,
        scheduler: Scheduler,
        settle: Callable[[], Coroutine[Promise[Any], None, None]],
    ) -> None:
        """``settle`` waits until the drive has shown what it makes of the last command."""
        self._axis = axis
        self._settle = settle
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
                f'{self._axis.name} takes no stream of targets: it was ended by {self._ended_by};'
                ' stop the publisher, call ~/enable or the service of a mode, then stream anew'
            )
        self._begun = True

    def follow(self, delivery: Promise[None]) -> None:
        """A target was commanded: stop the drive when it refuses it, or no other one follows."""
        delivery.when_done(self._note_delivery)
        self._goes_on_until = self._scheduler.now + self._axis.config.target_timeout
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
        if silence <= self._axis.config.target_timeout:
            self.end(by)
        else:
            self._ended_by, self._begun = '', False

    def _note_delivery(self, delivery: Promise[None]) -> None:
        axis = self._axis
        if delivery.error is None or self._ended_by or not axis.accepts_targets:
            return
        self.end('a target that the drive did not take')
        axis.hold()
        axis.warn(f'stopping: it has not taken a target of the stream ({delivery.error})')

    async def _watch_for_pause(self) -> None:
        while self._scheduler.now < self._goes_on_until:
            await self._scheduler.timer(self._goes_on_until - self._scheduler.now)
        axis = self._axis
        if not axis.accepts_targets:
            return  # what has taken it away has reported it
        paused = f'the stream of targets has paused for {axis.config.target_timeout * 1000:g} ms'
        if axis.mode.setpoint is not None and not axis.mode.cyclic:
            axis.warn(f'{paused}: it goes on to the last target, and rests there')
            return
        speed = axis.view.speed
        axis.hold()
        self._scheduler.background(self._report_rest(paused, speed))

    async def _report_rest(self, paused: str, speed: float) -> None:
        """Report the stop when the axis stands, not when the halt begins."""
        axis = self._axis
        timeout = STOP_TIMEOUT + speed / axis.view.parameters.profile.deceleration

        def ended() -> bool:
            stands = axis.mode.braked and axis.view.stands
            return stands or not axis.accepts_targets or not axis.halt.rests

        await self._settle()
        try:
            await self._scheduler.until(ended, timeout)
        except TimeoutError:
            axis.report(
                Severity.ERROR,
                f'{paused}: it was halted, but has not come to rest within {timeout:.1f} s and '
                f'moves at {axis.view.velocity:g} per second',
            )
            return
        if axis.halt.rests and axis.accepts_targets:
            axis.warn(f'{paused}: stopped; the next target goes on')
