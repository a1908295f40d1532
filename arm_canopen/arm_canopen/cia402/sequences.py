# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Stops and homing of an axis, and supervision of a stream of targets."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from contextlib import suppress
from enum import Enum
import math
from typing import Any

from canopen_core import CodecError, DriveError, SdoError
from canopen_core.standard import DriveState, Index, OperationMode, Statusword

from ..master.events import Severity
from ..master.scheduler import Promise, Scheduler, Task
from .axis import Axis
from .modes import Homing
from .motion import Refusal, RefusalCause
from .state import POWERED
from .steps import AxisSteps
from .stop import STOP_TIMEOUT

BRAKED_TIMEOUT = 10.0  # [s] for a halt to reach standstill, added to the time of the ramp


class StopCommands:
    """Disable, halt, quick stop and shutdown of one axis."""

    def __init__(self, steps: AxisSteps, scheduler: Scheduler) -> None:
        self._axis = steps.axis
        self._steps = steps
        self._scheduler = scheduler

    async def disable(self) -> str:
        """Disable to Switched On, as ros2_canopen's service does; the motor has no torque."""
        axis = self._axis
        if not await self._ready_to_stop('disabled'):
            return await self.shutdown()
        if axis.view.state is DriveState.OPERATION_ENABLED:
            await self._escalated(self._steps.reach(DriveState.SWITCHED_ON))
        else:
            await self._stay_disabled()
        return await self.at_rest()

    async def halt(self) -> str:
        """Halt and stay enabled (bit 8, option code 0x605D) until the next single target.

        A drive that does not slow down, or receives no PDO, gets a quick stop.
        """
        axis = self._axis
        if not await self._ready_to_stop('halted'):
            return await self._quick_stop()
        if self._is_quick_stopped():
            return f'nothing to halt: {await self.at_rest()}'
        if not axis.stays_enabled:
            await self._stay_disabled()
            return f'nothing to halt: {await self.at_rest()}'
        # any pending command
        axis.goal = DriveState.OPERATION_ENABLED
        await self._escalated(self._steps.come_to_halt(BRAKED_TIMEOUT))
        return axis.describe()

    async def quick_stop(self) -> str:
        """Quick stop; option code 0x605A determines the state of the drive afterwards."""
        axis = self._axis
        reachable = await self._ready_to_stop('quick stop')
        if not reachable or axis.view.state is DriveState.OPERATION_ENABLED:
            return await self._quick_stop()
        if not self._is_quick_stopped():
            await self._stay_disabled()
        return f'nothing to stop: {await self.at_rest()}'

    async def shutdown(self) -> str:
        """Bring the drive to rest and remove its power.

        Raises:
            DriveError: Feedback did not confirm rest without power.
        """
        axis = self._axis
        axis.interrupted = None
        axis.released(Refusal(RefusalCause.SHUTDOWN))
        self._require_booted()
        axis.goal = DriveState.SWITCH_ON_DISABLED
        await axis.stop.run()
        if not await axis.stop.confirmed():
            what = 'not seen to come to rest' if axis.stop.disabled else 'not disabled'
            raise self._steps.refused(f'is {what}; cut its power')
        return axis.describe()

    async def _quick_stop(self) -> str:
        """Quick stop by RPDO or SDO; remove power if the drive does not stop."""
        axis = self._axis
        axis.goal = DriveState.QUICK_STOP_ACTIVE
        await axis.stop.run(disables=False)
        if not axis.stop.rests:
            raise self._steps.refused('is not seen to come to rest; cut its power')
        return axis.describe()

    async def _escalated(self, stop: Coroutine[Promise[Any], None, None]) -> None:
        """Await a stop; if it fails, await the stop sequence or give a quick stop."""
        axis = self._axis
        try:
            await stop
        except DriveError as error:
            if axis.stop.running:
                await axis.stop.ended()
                if not axis.stop.rests:
                    raise
            elif axis.stays_enabled and not axis.view.stands:
                axis.warn(f'{error}; it gets a quick stop')
                await self._quick_stop()
            else:
                raise

    async def at_rest(self, timeout: float = STOP_TIMEOUT) -> str:
        """Wait for standstill, ``timeout`` in [s] after the ramp; describe the drive.

        Also wait for the end of a quick stop or fault reaction, which a halt does not affect.
        """
        view = self._axis.view

        def rests() -> bool:
            return view.stands and view.state is not DriveState.FAULT_REACTION_ACTIVE

        with view.looking(), suppress(TimeoutError):
            await self._scheduler.until(rests, timeout + self._axis.stop.ramp_time())
        if not rests():
            raise self._steps.refused('is not seen to come to rest; cut its power')
        return self._axis.describe()

    def _require_booted(self) -> None:
        if not self._axis.node.was_booted:
            raise self._steps.refused('is not known to stand, as it was never booted')

    async def _ready_to_stop(self, reason: str) -> bool:
        """Cancel current and pending motion; return True if PDOs can brake the drive."""
        axis = self._axis
        axis.interrupted = None
        axis.released(Refusal(RefusalCause.COMMANDED, reason))
        self._require_booted()
        if not axis.node.operational or axis.stop.running:
            return False
        try:
            await self._steps.ready(to_stop=True)
        except DriveError:
            return False  # it shows no state
        self._steps.require_no_fault()
        return True

    async def _stay_disabled(self) -> None:
        """Prevent enabling, even if the command for it is pending."""
        axis, steps = self._axis, self._steps
        axis.leave_operation()
        await axis.stop.ended()
        await steps.settle()
        await steps.until(
            lambda: axis.view.state not in POWERED,
            steps.quirks.state_timeout,
            DriveState.SWITCH_ON_DISABLED.title,
        )

    def _is_quick_stopped(self) -> bool:
        """Return whether a quick stop runs or has ended; a weaker stop must not replace it."""
        axis = self._axis
        quick_stop = DriveState.QUICK_STOP_ACTIVE
        if axis.view.state is not quick_stop and axis.goal is not quick_stop:
            return False
        axis.goal = quick_stop
        return True


EDGE_CYCLES = 3  # SYNC cycles until a drive sees bit 4 cleared
HOMING_START, START_CYCLES = 0.1, 6
"""Time in [s], and cycles of SYNC, after which a drive has overwritten the homing bits of the
last time: with a slow SYNC it gets its start later."""


class HomingProgress(Enum):
    """Current phase of homing."""

    ENABLING = 'enabling'
    SWITCHING = 'switching to mode 6'
    HOMING = 'homing'
    DONE = 'done'


async def home(
    steps: AxisSteps,
    method: int | None = None,
    notify: Callable[[HomingProgress], None] = lambda progress: None,
) -> str:
    """Home an enabled drive by a method of 0x6098; None uses the method in the drive.

    The drive stays in mode 6. Cancelling clears bit 4, which interrupts the homing. ``method``
    applies to this run only: 0x6098 always gets its previous value back.

    Returns:
        What was done, in words.

    Raises:
        DriveError: The drive has no homing, refuses the method, or fails.
    """
    axis = steps.axis
    homing = axis.modes[OperationMode.HOMING]
    supported = axis.view.parameters.supports(OperationMode.HOMING)
    if not (isinstance(homing, Homing) and supported):
        raise steps.refused('has no homing (mode 6 is not in 0x6502)')
    stored = await _stored_method(steps)
    if method is None and not stored:
        raise steps.refused('has no homing method (0x6098 is 0); name one')
    method = stored if method is None else method
    try:
        if method != stored:
            await _choose(steps, method)
        notify(HomingProgress.SWITCHING)
        await steps.switch(homing)
        notify(HomingProgress.HOMING)
        await _run(steps, homing, f'the end of homing {method}')
    finally:
        if method != stored:
            _put_back(steps, stored)
    if axis.view.statusword & Statusword.HOMING_ERROR:
        raise steps.refused(f'failed to home by method {method}')
    notify(HomingProgress.DONE)
    return f'homed by method {method}'


async def _run(steps: AxisSteps, homing: Homing, what: str) -> None:
    """Set bit 4 until the drive shows the end of homing, successful or not."""
    axis, view = steps.axis, steps.axis.view

    def is_cut() -> bool:  # it is not enabled any more: its homing bits mean nothing then
        view.observe()  # they come after the last cycle
        return view.state is not DriveState.OPERATION_ENABLED

    def is_over() -> bool:
        if not (view.fresh and view.statusword_came(since)):
            return False
        word = view.statusword
        done = Statusword.HOMING_ATTAINED
        if not steps.quirks.homed_without_arrival:
            done |= Statusword.TARGET_REACHED
        return bool(word & Statusword.HOMING_ERROR) or word & done == done

    # without a falling edge of bit 4 before, the drive would miss the start, and the bits of the
    # last homing would pass for those of this one; in motion, 35 and 37 would set another place
    await steps.pause(EDGE_CYCLES * axis.period)
    await steps.until(lambda: view.stands, STOP_TIMEOUT + axis.stop.ramp_time(), 'standstill')
    homing.started = True
    try:
        await steps.pause(max(HOMING_START, START_CYCLES * axis.period))
        since = steps.now
        await steps.until(
            lambda: is_cut() or is_over(),
            axis.config.homing_timeout,
            what,
            'raise homing_timeout_seconds in bus.yml where the way takes longer',
        )
    finally:
        homing.started = False
    if is_cut():
        raise steps.refused('was cut off while it homed, and is not homed')


async def _stored_method(steps: AxisSteps) -> int:
    """Return the present value of 0x6098, which the end of the last homing may have changed."""
    axis = steps.axis
    try:
        stored = await axis.node.objects.read_object(axis.view.at(Index.HOMING_METHOD))
    except (SdoError, CodecError):
        return axis.view.parameters.homing_method
    return stored if isinstance(stored, int) else axis.view.parameters.homing_method


def _put_back(steps: AxisSteps, method: int) -> None:
    """Restore a method without waiting, as a cancelled homing must not wait."""
    axis = steps.axis

    def check(written: Promise[None]) -> None:
        if written.error is not None:
            axis.warn(f'the homing method {method} was not put back into 0x6098: {written.error}')

    axis.node.objects.write_object(axis.view.at(Index.HOMING_METHOD), 0, method).when_done(check)


async def _choose(steps: AxisSteps, method: int) -> None:
    """Write a method; after a time-out the drive may still have taken it."""
    axis = steps.axis
    try:
        await axis.node.objects.write_object(axis.view.at(Index.HOMING_METHOD), 0, method)
    except (SdoError, CodecError) as error:
        raise DriveError(f'{axis.name} does not take homing method {method}: {error}') from error


class TargetStream:
    """Stream of targets from a topic, whose end is not announced.

    A publisher cannot know that its drive was halted, homed or switched to a mode in which its
    values have another meaning. A pause is not a request either, as stalled processes and networks
    cause pauses, too. So a stream that a command has ended stays blocked until a command enables
    the drive or selects a mode while no targets arrive.
    """

    def __init__(
        self,
        axis: Axis,
        scheduler: Scheduler,
        settle: Callable[[], Coroutine[Promise[Any], None, None]],
    ) -> None:
        """``settle`` waits until feedback shows the effect of the last command."""
        self._axis = axis
        self._settle = settle
        self._scheduler = scheduler
        self._came = -math.inf
        self._goes_on_until = 0.0
        self._ended_by = ''
        self._begun = False  # a stream has begun since the last command that admits one
        self._watch: Task[None] | None = None

    def admit(self) -> None:
        """Record a target of a stream; raise a DriveError if the stream is blocked."""
        self._came = self._scheduler.now
        if self._ended_by:
            raise DriveError(
                f'{self._axis.name} takes no stream of targets: it was ended by {self._ended_by};'
                ' stop the publisher, call ~/enable or the service of a mode, then stream anew'
            )
        self._begun = True

    def follow(self, delivery: Promise[None]) -> None:
        """Supervise a target: stop the drive if it refuses it or no other target follows."""
        delivery.when_done(self._note_delivery)
        self._goes_on_until = self._scheduler.now + self._axis.config.target_timeout
        if self._watch is None or self._watch.done:
            self._watch = self._scheduler.background(self._watch_for_pause())

    def end(self, by: str) -> None:
        """Block streams because of a command, named by ``by``."""
        self._ended_by = by
        if self._watch is not None:
            self._watch.cancel(DriveError('the stream was ended by a command'))

    def interrupt(self, by: str) -> None:
        """Block the stream that has begun, if any, even if it pauses."""
        if self._begun:
            self.end(by)

    def renew(self, by: str) -> None:
        """Admit a stream that begins from now on, but not one that already arrives."""
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
            return  # the cause has already been reported
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
