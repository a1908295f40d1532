# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Commands to an axis: coroutines of many cycles, each answered with a sentence.

First what runs and how targets are handed over, then the commands, then the steps that they are
made of: each step waits, and names what did not come.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
import contextlib
from dataclasses import replace
from typing import Any, TypeAlias, TypeVar

from canopen_core import CodecError, DriveError, SdoError, SdoTimeoutError
from canopen_core.standard import (
    DriveState,
    Index,
    object_address,
    OperationMode,
    Statusword,
    TARGET_OBJECTS,
)

from ..config.model.drive import RecoveryPolicy
from ..master.events import Severity
from ..master.scheduler import completed, Promise, Scheduler, Task
from .axis import Axis, NOT_TAKEN
from .halt import HaltState, RESUME_TIMEOUT
from .modes import Mode, Move, NoMode, ProfilePosition
from .modes.homing import home, HomingProgress
from .motion import Refusal, RefusalCause
from .quirks import quirks_of
from .state import FAULTY
from .stop import STOP_TIMEOUT, StopCommands
from .streaming import TargetStream
from .units import TORQUE_MODES

T = TypeVar('T')
Sequence: TypeAlias = Callable[[], Coroutine[Promise[Any], None, str]]

SELECT_MODE = '; select a mode before the first target'
TAKEN_TIMEOUT = RESUME_TIMEOUT + 1.0  # [s] after which nothing leads the drive out of its halt
BUFFER_CLEAR = 6  # sub-index of 0x60C4 (CiA 402-2, clause 12)
BUFFER_EMPTY, BUFFER_OPEN = 0, 1
BUFFER_ATTEMPTS = 4
READY_TIMEOUT = 2.0  # [s] from operational to the first PDOs and parameters
REFUSED_SHARE = 0.5  # of a time-out, after which a drive counts as one that refuses
SETTLE_CYCLES = 3  # of SYNC after which an answer shows what a command has done


class AxisCommands:
    """The commands of one axis. Each returns what was reached, or raises DriveError."""

    def __init__(self, axis: Axis, scheduler: Scheduler) -> None:
        self.axis = axis
        self.quirks = quirks_of(axis.config.quirks)  # where it deviates from the standard
        # it refuses mode 0, or Operation enabled in that
        self.needs_mode = self.quirks.no_mode_zero
        self.stops = StopCommands(self, scheduler)  # those that stop it
        self._stopping: dict[str, Sequence] = {
            'disable': self.stops.disable,
            'halt': self.stops.halt,
            'quick_stop': self.stops.quick_stop,
            'shutdown': self.stops.shutdown,
        }
        # those without arguments by name, for :meth:`request`
        self.offered: dict[str, Sequence] = {
            'init': self.init,
            'enable': self.enable,
            'recover': self.recover,
            'home': self.home,
            **self._stopping,
        }
        self._scheduler = scheduler
        self._keeps_mode_under_halt = False
        self._running = ''
        self._delivery = completed()  # of the target or move that was commanded last
        self._task: Task[str] | None = None
        self._leaving: Promise[str] | None = None  # the shutdown at the end of the master
        self._stream = TargetStream(axis, scheduler, self.settle)
        axis.on_ready = self._go_on

    # Which command runs.

    def request(self, name: str) -> Promise[str]:
        """Run one of those that are offered; what stops the drive ends the one that runs."""
        return self.run(name, self.offered[name](), preempt=name in self._stopping)

    def run(
        self,
        name: str,
        sequence: Coroutine[Promise[Any], None, str],
        *,
        preempt: bool = False,
        by_itself: bool = False,
    ) -> Promise[str]:
        """Run one of the coroutines below unless another one runs.

        Args:
            name: Name of the command, for messages.
            sequence: The coroutine.
            preempt: End the one that runs instead of being refused; for what stops a axis.
            by_itself: No client has requested it, so no stream of targets is let in for it.
        """
        if self._leaving is not None:
            sequence.close()
            return self._leaving if preempt else _refused(self._ending())
        if preempt:
            self.cancel(f'{self._running} was ended by {name}')
        if self._busy:
            sequence.close()
            return _refused(DriveError(f'{self.axis.name} is busy: {self._running} is running'))
        self._running = name
        if preempt:
            self._stream.end(name)
        elif by_itself:
            self._stream.interrupt(name)
        else:
            self._stream.renew(name)
        self._task = self._scheduler.spawn(sequence)
        return self._task

    def leave(self) -> Promise[str]:
        """Shut the drive down for good: what stops it has that result, all else is refused."""
        self._leaving = self.request('shutdown')
        return self._leaving

    def cancel(self, reason: str) -> None:
        """End the command that runs, if any."""
        if self._task is not None:
            self._task.cancel(DriveError(reason))

    @property
    def _busy(self) -> bool:
        """Whether a command runs."""
        return self._task is not None and not self._task.done

    @property
    def stopping(self) -> Promise[str] | None:
        """The command that stops the drive, while one runs."""
        if self._leaving is not None:
            return self._leaving
        return self._task if self._busy and self._running in self._stopping else None

    # Targets and moves.

    def set_target(self, target: float) -> str:
        """Move to a position, at a velocity or with a torque, in the mode that is selected."""
        mode = self.axis.mode
        self._set(mode.set_target, target)
        self._stream.interrupt('a single target')
        return f'target {target:g} in mode {mode.number.title}'

    def deliver(self, command: Callable[[], str]) -> Promise[str]:
        """Run ``command``, which sets a target or a move.

        Done when the drive has it, and no halt keeps it.
        """
        return self._scheduler.spawn(self._delivered(command))

    async def _delivered(self, command: Callable[[], str]) -> str:
        axis = self.axis
        mode, answer = axis.mode, command()
        delivery, motion = self._delivery, axis.motions
        try:
            await self._taken(mode, delivery)
        except DriveError as error:  # a target that was reported as failed must not move it later
            if delivery.done and not isinstance(delivery.error, SdoTimeoutError):
                raise
            if isinstance(mode, ProfilePosition) and mode.withdraw(delivery, error):
                raise DriveError(f'{error}; it is withdrawn') from error
            if axis.accepts_targets and axis.motions == motion:
                axis.hold()
            raise
        return answer

    async def _taken(self, mode: Mode, delivery: Promise[None]) -> None:
        """Wait until the drive has what was commanded in a mode, and no halt keeps it."""
        axis = self.axis
        halt = axis.halt

        def stopped() -> bool:
            led_away = axis.stop.running or not axis.stays_enabled
            return halt.rests or led_away or axis.mode is not mode

        await self.until(
            lambda: stopped() or (delivery.done and not halt.leaving),
            TAKEN_TIMEOUT + axis.node.config.sdo_timeout,
            'its target',
        )
        if halt.state is HaltState.UNANSWERED:
            raise DriveError(f'{axis.name} stays halted: {NOT_TAKEN}')
        error = delivery.error
        if error is not None and not (stopped() and isinstance(error, DriveError)):
            raise self.refused(f'has not taken its target ({error})')
        if stopped():
            raise self.refused('was stopped before it had taken the target')

    async def arrive(self, command: Callable[[], str], timeout: float) -> str:
        """Run ``command``, which sets a target or a move, and wait until the drive stands there.

        One that is later than ``timeout`` in [s] is halted.

        Raises:
            DriveError: It is late, was stopped before, or got another target or mode.
        """
        axis = self.axis
        delivered = self.deliver(command)
        mode, motion = axis.mode, axis.motions
        await delivered

        def lost() -> bool:
            replaced = axis.motions != motion or axis.mode is not mode
            return axis.halt.rests or replaced or not axis.acts or not axis.view.fresh

        def arrived() -> bool:
            return mode.reached(axis.view.statusword) and axis.view.stands

        try:
            await self._scheduler.until(lambda: lost() or arrived(), timeout)
        except TimeoutError:
            if not lost():  # else the motion is that of somebody else
                late = f'{axis.name} has not arrived within {timeout:g} s'
                try:
                    late = f'{late}, and was halted: {await self.request("halt")}'
                except DriveError as error:
                    late = f'{late}, and was commanded to halt: {error}'
                raise DriveError(late) from None
        if lost():
            raise self.refused('was stopped, or got another target, before it arrived')
        return axis.describe()

    def stream_target(self, target: float) -> None:
        """Follow a stream of targets; when it pauses for too long, the drive stops."""
        self._stream.admit()
        self._set(self.axis.mode.follow_target, target)
        self._stream.follow(self._delivery)

    def move(self, move: Move) -> str:
        """Hand a move to the drive in mode 1, with all that the mode offers.

        Raises:
            DriveError: Another mode is selected, or the drive cannot take it.
        """
        axis, mode = self.axis, self.axis.mode
        if not isinstance(mode, ProfilePosition):
            raise self.refused('moves only in mode 1; select position_mode first')
        self._require_acceptance()
        if axis.halt.rests:
            move = replace(move, immediate=True)  # the halt has ended the moves before it
        destination = self._named(lambda: mode.destination(move))
        axis.check_target(destination)
        delivery = self._named(lambda: mode.move(move))
        self._stream.interrupt('a single move')
        self._resume(delivery)
        if not move.immediate:
            self._delivery = completed()  # answered when it is queued, not when its turn comes
        how = 'at once' if move.immediate and mode.waiting == 1 else 'after the moves before it'
        return f'to {destination:g}, {how}'

    def _set(self, command: Callable[[float], Promise[None]], target: float) -> None:
        self._require_acceptance()
        self.axis.check_target(target)
        self._resume(self._named(lambda: command(target)))

    def _named(self, command: Callable[[], T]) -> T:
        """Command the mode; what it refuses gets the name of the axis."""
        try:
            return command()
        except DriveError as error:
            raise DriveError(f'{self.axis.name}: {error}') from error

    def _require_acceptance(self) -> None:
        axis = self.axis
        if self._leaving is not None:
            raise self._ending()
        if self._busy:
            raise self.refused(f'takes no target while {self._running} is running')
        refusal = axis.refusal
        if refusal is None:
            return
        if refusal.cause in (RefusalCause.FAULT, RefusalCause.NOT_ENABLED):
            raise self.refused(f'takes no target; {self.way_to_enable()}')
        if refusal.cause is RefusalCause.MODE_CHANGE and isinstance(axis.mode, NoMode):
            return  # which refuses every target itself
        if refusal.cause is RefusalCause.OFFLINE:
            raise self.refused('takes no target')  # whose description says why
        raise self.refused(f'takes no target: it {refusal}')

    def _ending(self) -> DriveError:
        return DriveError(f'{self.axis.name} takes no command any more: the master is ending')

    def _resume(self, delivery: Promise[None]) -> None:
        self._delivery = delivery
        self.axis.motions += 1
        self.axis.halt.leave(self._scheduler.now, delivery)  # so that no old one revives
        self.axis.released(Refusal(RefusalCause.SINGLE_TARGET))

    # The commands, beside those of ``stop.py``.

    async def init(self) -> str:
        """Reset a fault, enable, home where bus.yml has a method, and select no mode.

        A drive that refuses to have no mode is left in the one that it had, or bus.yml names.
        """
        axis = self.axis
        await self.ready()
        axis.released(Refusal(RefusalCause.COMMANDED, 'init'))
        await self.reset_fault()
        await self.reach(DriveState.OPERATION_ENABLED)
        await self.come_to_rest()
        homed = ''
        before = self.mode_to_return_to()
        try:
            if axis.view.parameters.supports(OperationMode.HOMING):
                homed = await self._home_at_init()
            if self.needs_mode and axis.mode.number is OperationMode.HOMING:
                await self.return_to(before)
        finally:
            if axis.node.online and not self.needs_mode:
                axis.select(axis.modes[OperationMode.NO_MODE])
                axis.halt.end_in(OperationMode.NO_MODE)
        mode = axis.mode.number
        hint = f', in mode {mode.title}, as it refuses to have none' if mode else SELECT_MODE
        return f'{axis.view.state.title}{homed}{hint}'

    async def enable(self) -> str:
        """Lead to Operation Enabled, without homing and without resetting a fault."""
        await self.ready()
        self.require_no_fault()
        await self.reach(DriveState.OPERATION_ENABLED)
        return self._enabled()

    async def recover(self) -> str:
        """Reset a fault and lead to Operation Enabled, with no target left over."""
        await self.ready()
        await self.reset_fault()
        await self.reach(DriveState.OPERATION_ENABLED)
        return self._enabled()

    def _enabled(self) -> str:
        """Describe an enabled drive; one that came back to the bus has lost its mode."""
        has_mode = self.axis.mode.number is not OperationMode.NO_MODE
        return self.axis.describe() + ('' if has_mode else SELECT_MODE)

    async def home(
        self,
        method: int | None = None,
        notify: Callable[[HomingProgress], None] = lambda progress: None,
    ) -> str:
        """Enable the drive if it is not, home it, and select the mode of before again.

        By a method of 0x6098, None for the one in the drive; ``notify`` gets each phase when it
        begins.
        """
        axis = self.axis
        await self.ready()
        self.require_no_fault()
        notify(HomingProgress.ENABLING)
        await self.reach(DriveState.OPERATION_ENABLED)
        before = self.mode_to_return_to()
        try:
            answer = await home(self, method, notify)
        except BaseException:  # also when it is cancelled, and there is no time to wait
            axis.select_back(before)
            raise
        await self.return_to(before)
        return f'{answer}; {axis.describe()}'

    async def select_mode(self, number: OperationMode) -> str:
        """Switch the mode of operation; the drive is left as enabled as it was.

        Raises:
            DriveError: The drive is offline or faulted, lacks the mode, or does not switch.
        """
        axis = self.axis
        await self.ready()
        self.require_no_fault()
        mode = axis.modes.get(number)
        if mode is None or not axis.view.parameters.supports(number):
            raise DriveError(self._missing_mode(number))
        if axis.view.mode == number and axis.mode is mode:
            return f'already in mode {number.title}; {axis.describe()}'
        await self.switch(mode)
        enabled = axis.view.state is DriveState.OPERATION_ENABLED
        hint = '' if enabled else f'; not enabled, {self.way_to_enable()}'
        return f'{axis.describe()}{hint}'

    async def _home_at_init(self) -> str:
        """Home where bus.yml has a method; return what was done, or what could be."""
        axis = self.axis
        write = axis.node.config.write_of(axis.view.at(Index.HOMING_METHOD), 0)
        if write is not None and (method := int.from_bytes(write.data, 'little', signed=True)):
            return f', {await home(self, method)}'
        stored = axis.view.parameters.homing_method
        if not stored:
            return ''
        return (
            f', not homed: method {stored} is set in the drive (0x6098), but not in bus.yml; call '
            '~/home if it has to be homed'
        )

    def _go_on(self) -> None:
        """Enable it again in the mode that it had before a loss, where bus.yml wants that."""
        axis = self.axis
        mode, axis.interrupted = axis.interrupted, None
        if mode is not None and axis.config.recovery is RecoveryPolicy.AUTO:
            self._scheduler.background(self._go_on_in(mode))

    async def _go_on_in(self, mode: OperationMode) -> None:
        axis = self.axis
        if axis.view.state in FAULTY:
            await axis.view.read_error_code()
            axis.warn(f'not enabled again: {axis.describe()}; recover it')
            return
        try:
            await self.run('recovery', self._enable_in(mode), by_itself=True)
        except DriveError as error:
            axis.report(Severity.ERROR, f'not enabled again: {error}')
        else:
            axis.report(Severity.INFO, f'enabled again (recovery: auto): {axis.describe()}')

    async def _enable_in(self, mode: OperationMode) -> str:
        await self.ready()
        await self.reach(DriveState.OPERATION_ENABLED)
        if mode in (OperationMode.NO_MODE, OperationMode.HOMING):
            return self.axis.describe()
        return await self.select_mode(mode)

    def _missing_mode(self, number: OperationMode) -> str:
        axis = self.axis
        parameters = axis.view.parameters
        offered = ', '.join(
            mode.number.title
            for mode in axis.modes.values()
            if mode.number and parameters.supports(mode.number)
        )
        if not parameters.supports(number):
            why = f'the drive does not have it (0x6502 is 0x{parameters.supported_modes:X})'
        else:
            target = TARGET_OBJECTS.get(number)
            place = object_address(axis.view.at(target[0])) if target is not None else 'its target'
            why = f'{place} is in no RPDO of bus.yml; map it'
        return f'{axis.name} has no mode {number.title}: {why}; it has: {offered}'

    # Steps.

    @property
    def now(self) -> float:
        """Steady time in [s]."""
        return self._scheduler.now

    async def ready(self, *, to_stop: bool = False) -> None:
        """Wait for state and parameters of a drive that has just come up.

        With ``to_stop`` a drive whose state is not fresh is ready, too.

        Raises:
            DriveError: It is offline, is being stopped or could not be, or does not send them.
        """
        axis = self.axis
        self._require_operational()
        if axis.stop.running and not to_stop:
            raise self.refused('is being stopped')
        if axis.failure:
            await axis.stop.run()  # once more, as the first may not have reached the drive
        await axis.stop.ended()
        if axis.failure and not (to_stop or axis.stop.disabled):
            raise self.refused('could not be stopped; cut its power')
        axis.unmute_controlword()  # what is commanded next goes by RPDO again

        def ready() -> bool:
            known = to_stop and axis.view.state is not DriveState.UNKNOWN
            return known or axis.view.ready or not axis.node.operational

        try:
            await self._scheduler.until(ready, READY_TIMEOUT)
        except TimeoutError:
            raise DriveError(self._why_not_ready()) from None
        self._require_operational()

    async def reach(self, goal: DriveState) -> None:
        """Lead to a state.

        Raises:
            DriveError: It is not reached; then the drive is led to Switch On Disabled. It is not
                enabled where it does not take the value that holds it.
        """
        axis = self.axis
        enabling = goal is DriveState.OPERATION_ENABLED
        if enabling and not axis.stays_enabled:
            await self._begin_enabling()
        timeout = self.quirks.state_timeout
        if not enabling:  # it may brake first (0x605B, 0x605C)
            timeout += axis.stop.ramp_time()
        try:
            if enabling:
                await self._select_where_required(timeout)
            axis.goal = goal
            slow = 'if it only takes longer: `quirks: slow_states` in bus.yml'
            await self.until(
                lambda: axis.view.state is goal and not axis.stop.running,
                timeout,
                goal.title,
                slow,
            )
        except BaseException:  # also when it is cancelled: the rest of the way is not awaited
            axis.leave_operation()
            raise

    async def _begin_enabling(self) -> None:
        """Clear what stopped it before, and hold it where it is."""
        axis = self.axis
        if axis.stop.running:
            raise self.refused('is being stopped')
        axis.failure = ''
        mode, shown = axis.mode, axis.shown_mode
        await self._preload(mode, 'is not enabled')
        if shown is not mode:  # in which it may stay
            await self._preload(shown, 'is not enabled')
        if axis.failure:
            raise self.refused('is not enabled')

    async def _select_where_required(self, timeout: float) -> None:
        """Select the mode of bus.yml for a drive that refuses Operation enabled without one.

        An enabled drive shows within ``timeout`` in [s] that it does.
        """
        axis = self.axis
        mode = self._configured_mode()
        if mode is None or axis.mode.number:
            return
        if not self.needs_mode:
            if axis.view.mode:
                return
            axis.goal = DriveState.OPERATION_ENABLED
            with contextlib.suppress(TimeoutError):
                await self._scheduler.until(
                    lambda: axis.view.state is axis.goal or self._is_hopeless(),
                    REFUSED_SHARE * timeout,
                )
            if axis.view.state is not DriveState.SWITCHED_ON or self._is_hopeless():
                return
            self.needs_mode = True
            axis.warn(
                'stays in Switched on while no mode is selected (0x6061 is 0): mode '
                f'{mode.number.title} of bus.yml is selected first; with `quirks: no_mode_zero` '
                'that is done at once'
            )
            axis.goal = DriveState.SWITCHED_ON
        await self.switch(self.mode_to_return_to())  # one that it shows goes with the next RPDO

    def _configured_mode(self) -> Mode | None:
        """Return the first mode that bus.yml names and the drive has."""
        axis = self.axis
        for number in (
            axis.config.position_mode,
            axis.config.velocity_mode,
            axis.config.effort_mode,
        ):
            mode = None if number is None else axis.modes.get(number)
            if mode is not None and mode.number and axis.view.parameters.supports(mode.number):
                return mode
        return None

    def mode_to_return_to(self) -> Mode:
        """Return the mode for the time after homing; mode 0 only where the drive takes it."""
        axis = self.axis
        if axis.mode.number or not self.needs_mode:
            return axis.mode
        shown = axis.shown_mode
        if shown is not None and shown.number not in (OperationMode.NO_MODE, OperationMode.HOMING):
            return shown
        return self._configured_mode() or axis.mode

    async def return_to(self, mode: Mode) -> None:
        """Select the mode of before homing again, unless the drive refuses that one."""
        if mode is not self.axis.mode and (mode.number or not self.needs_mode):
            await self.switch(mode)

    async def _preload(self, mode: Mode | None, consequence: str) -> None:
        """Write the holding value of a mode whose target goes by SDO, whatever the drive has."""
        if mode is None or not mode.by_sdo:
            return
        try:
            await self.axis.preload(mode)
        except (SdoError, CodecError) as error:
            raise self.refused(
                f'{consequence}: it does not take the target that holds it in mode '
                f'{mode.number.title} ({error})'
            ) from error

    async def come_to_rest(self) -> None:
        """Halt what moves before another mode ends it with a jerk; the drive stays halted.

        A torque is left alone: taking it away would drop a load.
        """
        axis = self.axis
        acting = axis.holding_mode
        enabled = axis.goal is axis.view.state is DriveState.OPERATION_ENABLED
        if not enabled or acting is None:
            return
        if acting.number in (*TORQUE_MODES, OperationMode.NO_MODE):
            return
        await self.come_to_halt(STOP_TIMEOUT)

    async def come_to_halt(self, timeout: float) -> None:
        """Halt a drive that is enabled, and wait until it stands.

        The ``timeout`` in [s] is beside the time of the ramp.

        Raises:
            DriveError: It does not come to rest; it stays halted.
        """
        axis, view = self.axis, self.axis.view
        ramp = view.speed / view.parameters.profile.deceleration  # [s]
        axis.hold()
        await self.settle()
        with view.looking():
            await self.until(
                lambda: axis.mode.braked and view.stands, timeout + ramp, 'standstill'
            )

    async def reset_fault(self) -> None:
        """Reset a fault if there is one."""
        axis = self.axis
        if axis.view.state not in FAULTY:
            return
        axis.resetting = True
        try:
            await self.until(
                lambda: axis.view.state not in FAULTY,
                self.quirks.state_timeout,
                'the end of the fault',
            )
        finally:
            axis.resetting = False
        axis.view.error = ''

    async def switch(self, mode: Mode) -> None:
        """Switch in the state that bus.yml wants, then return to the state of before.

        Raises:
            DriveError: 0x6061 does not show the mode in time; the one before is selected again.
        """
        axis = self.axis
        before = axis.mode
        enabled = axis.view.state is DriveState.OPERATION_ENABLED
        switching_state = axis.config.switching_state
        leave = enabled and switching_state is not DriveState.OPERATION_ENABLED
        axis.released(Refusal(RefusalCause.MODE_SELECTED, mode.number.title))
        await self.come_to_rest()
        await self._preload(mode, 'is not switched')
        if leave:
            await self.reach(switching_state)
        if mode.number is OperationMode.INTERPOLATED_POSITION:
            await self._clear_buffer()
        try:
            await self._show(mode)
        except BaseException:  # also when it is cancelled: it stays halted in either mode
            axis.select_back(before)
            raise
        axis.halt.release()
        if leave:
            await self.reach(DriveState.OPERATION_ENABLED)

    async def _show(self, mode: Mode) -> None:
        """Select a mode, and wait until 0x6061 shows it."""
        axis = self.axis
        timeout = self.quirks.mode_timeout

        def shown() -> bool:
            return axis.view.mode == mode.number

        axis.select(mode)
        acting = axis.holding_mode
        halted = acting is not None and bool(axis.halt.bits(acting))
        if halted and not self._keeps_mode_under_halt:
            with contextlib.suppress(TimeoutError):
                await self._scheduler.until(
                    lambda: shown() or self._is_hopeless(), REFUSED_SHARE * timeout
                )
        if halted and acting is not None and not shown():
            await self._end_halt_at_rest(acting)
            axis.select(mode)
        await self.until(
            lambda: axis.mode is mode and axis.shows_mode,  # a lost device has mode 0
            timeout,
            f'mode {mode.number.title} in 0x6061',
            'does its switching_state in bus.yml fit?',
        )
        if halted and not axis.halt.held and not self._keeps_mode_under_halt:
            self._keeps_mode_under_halt = True
            axis.warn(
                'ignores 0x6060 while it is halted (bit 8): from now on bit 8 is taken back at '
                'rest while its mode is switched'
            )

    async def _end_halt_at_rest(self, acting: Mode) -> None:
        """Clear bit 8 where the drive stands; no older target acts then."""
        axis = self.axis
        if acting.number in TORQUE_MODES:
            raise self.refused(
                'does not switch its mode while it is halted (bit 8), and a torque would move it '
                'without; disable it, select the mode, and enable it again'
            )
        axis.select(acting)
        actual = axis.view.actual()
        if isinstance(acting, ProfilePosition):
            here = axis.view.units.position.commanded(actual.position_inc)
            delivery = acting.set_target(here)
        else:
            delivery = acting.preload(actual)
        axis.halt.leave(self._scheduler.now, delivery)
        await self.until(
            lambda: not axis.halt.leaving, RESUME_TIMEOUT + 1.0, 'the end of its halt'
        )
        if axis.halt.held:
            raise DriveError(f'{axis.name} stays halted: {NOT_TAKEN}')

    async def _clear_buffer(self) -> None:
        """Empty the buffer of mode 7, and open it, where the drive has one (0x60C4:06)."""
        axis = self.axis
        index = axis.view.at(Index.INTERPOLATION_CONFIGURATION)
        entry = axis.node.config.dictionary.get(index, BUFFER_CLEAR)
        if entry is None or not entry.access.writable:
            return
        for value in (BUFFER_EMPTY, BUFFER_OPEN):
            failure: SdoError | None = None
            for _ in range(BUFFER_ATTEMPTS):
                failure = await self._written(index, BUFFER_CLEAR, value)
                if not isinstance(failure, SdoTimeoutError):
                    break
            if isinstance(failure, SdoTimeoutError):
                raise self.refused(f'did not open its buffer of mode 7 ({failure})')
            if failure is not None:
                axis.report(Severity.WARNING, f'its buffer of mode 7 is as it was: {failure}')
                return

    async def _written(self, index: int, subindex: int, value: int) -> SdoError | None:
        """Write an object; return why that failed, or None."""
        try:
            await self.axis.node.objects.write_object(index, subindex, value)
        except SdoError as error:
            return error
        return None

    async def settle(self) -> None:
        """Wait until the drive has shown what it makes of the command that was sent last."""
        await self.pause(SETTLE_CYCLES * self.axis.period)

    async def pause(self, duration: float) -> None:
        """Wait for a time in [s]."""
        await self._scheduler.timer(duration)

    async def until(
        self, condition: Callable[[], bool], timeout: float, what: str, remedy: str = ''
    ) -> None:
        """Wait for a condition, ``what`` in words, for at most ``timeout`` in [s].

        The ``remedy`` helps where it takes longer and nothing else is known to keep the axis.

        Raises:
            DriveError: It does not hold in time, or the drive faults or is lost before.
        """
        try:
            await self._scheduler.until(lambda: condition() or self._is_hopeless(), timeout)
        except TimeoutError:
            why = self._why() or (f' ({remedy})' if remedy else '')
            raise self.refused(f'did not reach {what} within {timeout:g} s{why}') from None
        if not condition():
            await self.axis.view.read_error_code()
            raise self.refused(f'did not reach {what}')

    def _is_hopeless(self) -> bool:
        axis = self.axis
        faulted = axis.view.state in FAULTY and not axis.resetting
        return not axis.node.operational or faulted or axis.stop.running

    def require_no_fault(self) -> None:
        """Refuse to go on with a drive that is faulted."""
        if self.axis.view.state in FAULTY:
            raise self.refused('is faulted; recover it first')

    def refused(self, what: str) -> DriveError:
        """Return an error with what went wrong, and the state of the axis."""
        return DriveError(f'{self.axis.name} {what}: {self.axis.describe()}')

    def way_to_enable(self) -> str:
        """Name what enables the axis."""
        return 'recover it' if self.axis.view.state in FAULTY else 'init or enable it'

    def _why(self) -> str:
        """Name the condition outside of the bus keeps the drive from being enabled."""
        word = self.axis.view.statusword
        if not word & Statusword.VOLTAGE_ENABLED:
            return (
                ' (no voltage at the power stage, bit 4: is the safe torque off or the e-stop on?)'
            )
        if not word & Statusword.REMOTE:
            return ' (bit 9, remote, is not set: is the drive under local control?)'
        if self.axis.view.state is DriveState.SWITCHED_ON and not self.axis.view.mode:
            return (
                ' (0x6061 is 0: does it refuse that without a mode? Select one before, or name '
                'position_mode in bus.yml)'
            )
        return ''

    def _require_operational(self) -> None:
        if not self.axis.node.operational:
            raise DriveError(f'{self.axis.name} is not operational: {self.axis.describe()}')

    def _why_not_ready(self) -> str:
        axis = self.axis
        known = axis.view.state is not DriveState.UNKNOWN
        if known and not axis.view.fresh:
            return f'{axis.name} does not send its TPDOs any more: {axis.describe()}'
        if not known:
            return (
                f'{axis.name} is operational, but its statusword, mode and position have not '
                'come; do its TPDOs follow SYNC, and does the bus.yml have a sync_period?'
            )
        return (
            f'{axis.name} has not answered the SDOs for its parameters (modes 0x6502, limits '
            f'0x607D, profile 0x6081): {axis.describe()}'
        )


def _refused(error: DriveError) -> Promise[str]:
    refused: Promise[str] = Promise()
    refused.reject(error)
    return refused
