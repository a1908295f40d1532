# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The stop of an axis: halt, then quick stop, then no power, until it was seen to rest.

What still reaches the drive commands it: its RPDO, else an SDO. A drive that one step does not
slow down gets the next. "Unknown" is never "stopped".
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields
import math
from typing import Any, TYPE_CHECKING

from canopen_core import CanopenError, CodecError, DriveError, SdoError
from canopen_core.standard import DriveState, Index, NmtCommand, NmtState, statusword_text

from ..master.events import Severity
from ..master.scheduler import Promise, Scheduler, Task
from .motion import Refusal, RefusalCause
from .state import AxisState, FAULTY, POWERED
from .state_machine import Command

if TYPE_CHECKING:
    from .axis import Axis
    from .commands import AxisCommands

REACTION_TIME = 0.5  # [s] in which a drive shows that it has got a command
UNSEEN_TIMEOUT = 1.0  # [s] for it to show anything, beside the time of the ramp
STOP_TIMEOUT = 2.0  # [s] to come to rest, beside the time of the ramp
RAMP_MAX = 10.0  # [s] that a ramp may take on the way out; then the power goes all the same
SHUTDOWN_MAX = STOP_TIMEOUT + RAMP_MAX + 2 * STOP_TIMEOUT
"""Longest time of a shutdown in [s]: to brake, to lose the power, and to run out without it."""
DISABLED = (DriveState.SWITCH_ON_DISABLED, DriveState.NOT_READY_TO_SWITCH_ON, DriveState.FAULT)
"""States without power; after UNKNOWN and in the reaction to a fault it may still move."""
BRAKED_TIMEOUT = 10.0  # [s] for a halt to end in standstill, beside the time of the ramp
FALLEN_RATIO = 0.98  # of the least speed so far, below which a speed is falling
SLOWING_RATIO = 0.04  # of the time of a ramp, in which more than that has to be seen


class BrakingWatch:
    """Judges whether a stop that was commanded slows an axis down, by its positions."""

    def __init__(self) -> None:
        self._least = math.inf
        self._since = 0.0

    def clear(self) -> None:
        """Judge from the next speed on."""
        self._least = math.inf

    def fails(self, now: float, view: AxisState, deceleration: float) -> bool:
        """Return whether the axis was seen for too long not to slow down.

        The ``deceleration`` of the stop is in user units per second squared.
        """
        if not view.speed_known:
            self.clear()
            return False
        speed = max(abs(view.rate), view.rest_speed)
        if speed == view.rest_speed or speed < FALLEN_RATIO * self._least:
            self._least, self._since = speed, now
        return now - self._since > max(REACTION_TIME, SLOWING_RATIO * speed / deceleration)


class StopSequence:
    """Stops a drive and takes its power away; every step has a deadline.

    A drive that does not react to its RPDO, or gets none because its device is not operational,
    is commanded by SDO; then no RPDO carries its controlword any more, which might enable it
    again. Where the SDO fails, the RPDO leaves again if it can. What its TPDOs do not show is read
    by SDO. A drive that a quick stop does not slow down loses its power.
    """

    def __init__(self, axis: Axis, scheduler: Scheduler) -> None:
        """Nothing runs before :meth:`begin`."""
        # state that the drive is led to, whatever else is commanded; None while it does not run
        self.goal: DriveState | None = None
        self._axis = axis
        self._view = axis.view
        self._scheduler = scheduler
        self._task: Task[None] | None = None
        self._sdo_error = ''
        self._quiet = False
        self._disables = True
        self._braking = BrakingWatch()
        self._began = self._unseen_after = 0.0

    @property
    def running(self) -> bool:
        """Whether it has begun and not ended."""
        return self.goal is not None

    @property
    def disabled(self) -> bool:
        """Whether the drive was seen to be without power."""
        return self._view.seen and self._view.state in DISABLED

    @property
    def rests(self) -> bool:
        """Whether the drive was seen to stand, and no target moves it any more."""
        enabled = self._view.state in {DriveState.OPERATION_ENABLED, DriveState.UNKNOWN}
        return self._view.stands and not enabled

    def ramp_time(self) -> float:
        """Return how long it brakes in [s], by the slower of its ramps."""
        return min(RAMP_MAX, self._view.speed / self._deceleration)

    @property
    def _deceleration(self) -> float:
        parameters = self._view.parameters
        return min(parameters.quick_stop_deceleration, parameters.profile.deceleration)

    def begin(self, *, quiet: bool = False, disables: bool = True) -> None:
        """Begin, unless it runs already; what kept the RPDO from the drive before may be over.

        Args:
            quiet: Do not report what goes wrong: it is tried again and again.
            disables: Disable a drive that a quick stop holds at rest; one that runs does so, too.
        """
        if self.running:
            self._disables |= disables
            return
        self._quiet, self._disables = quiet, disables
        self._axis.unmute_controlword()
        self.goal = DriveState.QUICK_STOP_ACTIVE
        self._task = self._scheduler.background(self._run())

    async def run(self, *, disables: bool = True) -> None:
        """Begin if need be, and wait for the end."""
        if self._quiet:
            self.abandon('begun anew')  # what has failed in it may work now
        self.begin(disables=disables)
        await self.ended()

    async def confirmed(self) -> bool:
        """Return whether the drive is seen to stand without power now."""
        with self._view.looking():
            return await self._within(UNSEEN_TIMEOUT, lambda: self.disabled and self.rests)

    async def ended(self) -> None:
        """Wait until it does not run."""
        await self._within(SHUTDOWN_MAX + REACTION_TIME, lambda: not self.running)

    def abandon(self, reason: str) -> None:
        """End it where it is."""
        if self._task is not None:
            self._task.cancel(SdoError(reason))
        self.goal = None

    def use_sdo(self) -> None:
        """Command the drive by SDO from now on, because its RPDO does not reach it."""
        if self._axis.mutes_controlword:
            return
        self._axis.mute_controlword()
        if self.running:
            self._write()

    async def _run(self) -> None:
        """Lead through the steps; what holds already ends a step at once."""
        view = self._view
        self._sdo_error = ''
        self._note_sight()
        try:
            with view.looking():
                await self._lead(
                    DriveState.QUICK_STOP_ACTIVE,
                    lambda: self.disabled or self.rests,
                    STOP_TIMEOUT + RAMP_MAX,
                )
                braked = not self._gives_up()
                if not (self.disabled or self.rests):
                    self._report_motion()
                if not self._disables and (self.rests or (braked and not self.disabled)):
                    return
                await self._lead(
                    DriveState.SWITCH_ON_DISABLED, lambda: self.disabled, STOP_TIMEOUT
                )
                if not self.disabled:
                    error = f' ({self._sdo_error})' if self._sdo_error else ''
                    self._report(f'does not show that it is disabled{error}', '. Cut its power')
                elif not await self._within(STOP_TIMEOUT, lambda: self.rests):
                    self._report('has no power, but moves on', '. Does its brake hold?')
        finally:
            self.goal = None

    async def _lead(self, goal: DriveState, done: Callable[[], bool], timeout: float) -> None:
        """Command a state, again and again by SDO where the drive does not react to its RPDO."""
        self.goal = goal
        view, self._began = self._view, self._scheduler.now
        end = self._began + timeout
        self._braking.clear()

        def left() -> float:
            return max(0.0, end - self._scheduler.now)

        def reacts() -> bool:
            waits = (DriveState.OPERATION_ENABLED, DriveState.UNKNOWN)
            return done() or self._gives_up() or (view.seen and view.state not in waits)

        by_sdo = self._axis.controlword_muted or not view.node.operational
        while True:
            if by_sdo:
                if view.node.nmt_state is NmtState.STOPPED:  # in which it takes no SDO
                    view.node.send_nmt(NmtCommand.ENTER_PRE_OPERATIONAL)
                self._axis.mute_controlword()
                self._write()
            if await self._within(min(REACTION_TIME, left()), reacts) or not left():
                break
            if not by_sdo:
                self._braking.clear()  # the drive may not have got its command before
            by_sdo = True
        await self._within(left(), lambda: done() or self._gives_up())

    def _note_sight(self) -> None:
        """The drive is seen: should it fall silent, its ramp may take as long as from now on."""
        self._unseen_after = self._scheduler.now + UNSEEN_TIMEOUT + self.ramp_time()

    def _gives_up(self) -> bool:
        """Return whether the step is in vain: the drive does not slow down, or shows nothing."""
        view, now = self._view, self._scheduler.now
        if not view.seen:
            return now > self._unseen_after
        self._note_sight()
        idle = view.stands and view.state is DriveState.OPERATION_ENABLED
        if idle and now - self._began > STOP_TIMEOUT:
            return True
        return self._braking.fails(now, view, self._deceleration)

    def _report_motion(self) -> None:
        """Report that it is not seen to rest: it moves, or shows nothing any more."""
        view = self._view
        if view.seen:
            self._report('did not come to rest in time')
            return
        self._report(
            f'has sent no TPDO for {view.silence:.1f} s, and is not seen to come to rest; last',
            '. Check its power and cable',
        )

    def _report(self, what: str, remedy: str = '') -> None:
        if not self._quiet:
            view = self._view
            shown = 'nothing'
            if view.state is not DriveState.UNKNOWN:
                shown = statusword_text(view.statusword)
            if view.speed_known:
                shown += f'; {view.speed:.3g} per second'
            self._axis.report(Severity.ERROR, f'{what}: {shown}{remedy}')

    def _write(self) -> None:
        """Write the controlword of this step; the step does not wait for the answer."""
        quick_stop = self.goal is DriveState.QUICK_STOP_ACTIVE
        command = Command.QUICK_STOP if quick_stop else Command.DISABLE_VOLTAGE
        # a drive without quick stop stays halted
        self._scheduler.background(self._written(command | self._axis.halt_bits))

    async def _written(self, command: int) -> None:
        axis, place = self._axis, self._view.at(Index.CONTROLWORD)
        try:
            await axis.node.objects.write_object(place, 0, command, urgent=True)
        except (SdoError, CodecError) as error:
            self._sdo_error = str(error)
            if axis.mutes_controlword and axis.can_send(command):
                axis.unmute_controlword()

    async def _within(self, timeout: float, condition: Callable[[], bool]) -> bool:
        """Return whether a condition holds in time, for a drive whose cycle may fail."""
        view = self._view

        def holds() -> bool:
            try:
                view.observe()
            except Exception:  # noqa: BLE001  # what made the cycle fail may last
                view.lose_sight()
            return condition()

        try:
            await self._scheduler.until(holds, timeout)
        except TimeoutError:
            return False
        return True


class StopCommands:
    """Disable, halt, quick stop and shutdown of one axis."""

    def __init__(self, commands: AxisCommands, scheduler: Scheduler) -> None:
        self._axis = commands.axis
        self._commands = commands
        self._scheduler = scheduler

    async def disable(self) -> str:
        """Lead to Switched On, as ros2_canopen's service does; the motor is without torque."""
        axis = self._axis
        if not await self._ready_to_stop('disabled'):
            return await self.shutdown()
        if axis.view.state is DriveState.OPERATION_ENABLED:
            await self._escalated(self._commands.reach(DriveState.SWITCHED_ON))
        else:
            await self._stay_disabled()
        return await self.at_rest()

    async def halt(self) -> str:
        """Brake and stay enabled (bit 8, option code 0x605D); the next single target goes on.

        A drive that this does not slow down, or that no PDO reaches, gets a quick stop.
        """
        axis = self._axis
        if not await self._ready_to_stop('halted'):
            return await self._quick_stop()
        if self._is_quick_stopped():
            return f'nothing to halt: {await self.at_rest()}'
        if not axis.stays_enabled:
            await self._stay_disabled()
            return f'nothing to halt: {await self.at_rest()}'
        # whatever was about to lead it elsewhere
        axis.goal = DriveState.OPERATION_ENABLED
        await self._escalated(self._commands.come_to_halt(BRAKED_TIMEOUT))
        return axis.describe()

    async def quick_stop(self) -> str:
        """Quick stop; what follows at rest depends on the drive's option code 0x605A."""
        axis = self._axis
        reachable = await self._ready_to_stop('quick stop')
        if not reachable or axis.view.state is DriveState.OPERATION_ENABLED:
            return await self._quick_stop()
        if not self._is_quick_stopped():
            await self._stay_disabled()
        return f'nothing to stop: {await self.at_rest()}'

    async def shutdown(self) -> str:
        """Bring the drive to rest and take its power away.

        Raises:
            DriveError: It was not seen to rest without power.
        """
        axis = self._axis
        axis.interrupted = None
        axis.released(Refusal(RefusalCause.SHUTDOWN))
        self._require_booted()
        axis.goal = DriveState.SWITCH_ON_DISABLED
        await axis.stop.run()
        if not await axis.stop.confirmed():
            what = 'not seen to come to rest' if axis.stop.disabled else 'not disabled'
            raise self._commands.refused(f'is {what}; cut its power')
        return axis.describe()

    async def _quick_stop(self) -> str:
        """Quick stop by whatever reaches the drive; one that goes on loses its power."""
        axis = self._axis
        axis.goal = DriveState.QUICK_STOP_ACTIVE
        await axis.stop.run(disables=False)
        if not axis.stop.rests:
            raise self._commands.refused('is not seen to come to rest; cut its power')
        return axis.describe()

    async def _escalated(self, stop: Coroutine[Promise[Any], None, None]) -> None:
        """Await a stop; where it does not slow the drive down, the end of what follows it."""
        axis = self._axis
        try:
            await stop
        except DriveError:
            if not axis.stop.running:
                raise
            await axis.stop.ended()
            if not axis.stop.rests:
                raise

    async def at_rest(self, timeout: float = STOP_TIMEOUT) -> str:
        """Describe the drive when it was seen to stand, in [s] beside the time of the ramp.

        Waits for the end of what a halt leaves alone, too: a quick stop, the reaction to a fault.
        """
        view = self._axis.view

        def rests() -> bool:
            return view.stands and view.state is not DriveState.FAULT_REACTION_ACTIVE

        with view.looking(), suppress(TimeoutError):
            await self._scheduler.until(rests, timeout + self._axis.stop.ramp_time())
        if not rests():
            raise self._commands.refused('is not seen to come to rest; cut its power')
        return self._axis.describe()

    def _require_booted(self) -> None:
        if not self._axis.node.was_booted:
            raise self._commands.refused('is not known to stand, as it was never booted')

    async def _ready_to_stop(self, reason: str) -> bool:
        """End what moves the drive, now or later; True where PDOs can brake it."""
        axis = self._axis
        axis.interrupted = None
        axis.released(Refusal(RefusalCause.COMMANDED, reason))
        self._require_booted()
        if not axis.node.operational or axis.stop.running:
            return False
        try:
            await self._commands.ready(to_stop=True)
        except DriveError:
            return False  # it shows nothing, or not any more
        self._commands.require_no_fault()
        return True

    async def _stay_disabled(self) -> None:
        """Prevent enabling, also where the command for it is on its way."""
        axis, commands = self._axis, self._commands
        axis.leave_operation()
        await axis.stop.ended()
        await commands.settle()
        await commands.until(
            lambda: axis.view.state is not DriveState.OPERATION_ENABLED,
            commands.quirks.state_timeout,
            DriveState.SWITCH_ON_DISABLED.title,
        )

    def _is_quick_stopped(self) -> bool:
        """Whether a quick stop runs or has ended; then no lesser stop takes its place."""
        axis = self._axis
        quick_stop = DriveState.QUICK_STOP_ACTIVE
        if axis.view.state is not quick_stop and axis.goal is not quick_stop:
            return False
        axis.goal = quick_stop
        return True


@dataclass(frozen=True, slots=True)
class StopReport:
    """What became of the drives, by name."""

    stopped: tuple[str, ...]  # they moved, and stand now; still under power
    # they did not move visibly, and no target of before moves them any more
    standing: tuple[str, ...]
    unpowered: tuple[str, ...]  # they are not enabled, so nothing moves them
    failed: tuple[str, ...]  # why it is not known that they stand, each with its name

    def __str__(self) -> str:
        """Return it in a sentence, what is worst first."""
        named = (
            ('NOT known to stand', '; '.join(self.failed)),
            ('stopped', ', '.join(self.stopped)),
            ('stand', ', '.join(self.standing)),
            ('not enabled', ', '.join(self.unpowered)),
        )
        return '. '.join(f'{what}: {names}' for what, names in named if names) or 'no drives'


async def stop_all(commands: Sequence[AxisCommands], scheduler: Scheduler) -> StopReport:
    """Halt all drives, whatever moves them, and wait until each stands or has no power.

    One that does not come to rest keeps no other from it.
    """
    ends = [scheduler.spawn(_stopped(each, scheduler)) for each in commands]
    outcomes = [await end for end in ends]
    return StopReport(
        **{
            each.name: tuple(text for outcome, text in outcomes if outcome == each.name)
            for each in fields(StopReport)
        }
    )


async def _stopped(commands: AxisCommands, scheduler: Scheduler) -> tuple[str, str]:
    """Halt a drive; return its field of StopReport, and its name or why that is not known."""
    view = commands.axis.view
    moved = not view.stands
    try:
        try:
            await _to_its_end(commands.request('halt'), commands, scheduler)
        except CanopenError:
            if not (view.seen and view.state in FAULTY):
                raise
        await commands.stops.at_rest(BRAKED_TIMEOUT)
    except CanopenError as error:
        return 'failed', str(error)
    if view.state is DriveState.FAULT:  # its own reaction has ended its motion
        return 'unpowered', f'{view.name} (faulted)'
    if view.state not in POWERED:
        return 'unpowered', view.name
    return 'stopped' if moved else 'standing', view.name


async def _to_its_end(halt: Promise[str], commands: AxisCommands, scheduler: Scheduler) -> None:
    """Wait for a stop, or for the one that has taken its place."""
    while True:
        try:
            await halt
        except CanopenError:  # noqa: PERF203  # the other one may be replaced, too
            await scheduler.timer(0.0)  # until the other one has begun
            other = commands.stopping
            if other is None or other is halt:
                raise
            halt = other
        else:
            return
