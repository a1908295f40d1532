# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Commands to a drive: sequences of many cycles, each answered with a sentence."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from dataclasses import replace
from typing import Any, TypeAlias, TypeVar

from canopen_core import DriveError, SdoTimeoutError
from canopen_core.standard import DriveState, object_address, OperationMode, TARGET_OBJECTS

from ..config.model.drive import RecoveryPolicy
from ..master.events import Severity
from ..master.scheduler import completed, Promise, Scheduler, Task
from .drive import Drive
from .drive_control import NOT_TAKEN
from .drive_view import FAULTY
from .halt import RESUME_TIMEOUT
from .homing import home, HomingProgress, method_at_init
from .modes import Mode, NoMode
from .position_modes import Move, ProfilePosition
from .refusal import Refusal, RefusalCause
from .sequences import DriveSequences
from .stop_commands import StopCommands
from .streaming import TargetStream

T = TypeVar('T')
Sequence: TypeAlias = Callable[[], Coroutine[Promise[Any], None, str]]

SELECT_MODE = '; select a mode before the first target'
TAKEN_TIMEOUT = RESUME_TIMEOUT + 1.0  # [s] after which nothing leads the drive out of its halt


class Recovery:
    """Enables a drive again in the mode that it had, where bus.yml wants that."""

    def __init__(
        self,
        drive: Drive,
        scheduler: Scheduler,
        enable_in: Callable[[OperationMode], Promise[str]],
    ) -> None:
        """``enable_in`` begins a command that enables the drive in a mode."""
        self._drive = drive
        self._scheduler = scheduler
        self._enable_in = enable_in
        drive.on_ready = self._go_on

    def _go_on(self) -> None:
        drive = self._drive
        mode, drive.interrupted = drive.interrupted, None
        if mode is None or drive.config.recovery is not RecoveryPolicy.AUTO:
            return
        self._scheduler.background(self._recover(mode))

    async def _recover(self, mode: OperationMode) -> None:
        drive = self._drive
        if drive.view.state in FAULTY:
            await drive.view.read_error_code()
            drive.report(Severity.WARNING, f'not enabled again: {drive.describe()}; recover it')
            return
        try:
            await self._enable_in(mode)
        except DriveError as error:
            drive.report(Severity.ERROR, f'not enabled again: {error}')
        else:
            drive.report(Severity.INFO, f'enabled again (recovery: auto): {drive.describe()}')


class DriveCommands:
    """The commands of one drive. Each returns what was reached, or raises DriveError."""

    def __init__(self, drive: Drive, scheduler: Scheduler) -> None:
        self.drive = drive  # the drive
        self._steps = DriveSequences(drive, scheduler)
        self.stops = StopCommands(drive, self._steps, scheduler)  # those that stop it
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
        self._running = ''
        self._delivery = completed()  # of the target or move that was commanded last
        self._task: Task[str] | None = None
        self._leaving: Promise[str] | None = None  # the shutdown at the end of the master
        self._stream = TargetStream(drive, scheduler, self._steps)
        self._recovery = Recovery(
            drive,
            scheduler,
            lambda mode: self.run('recovery', self._enable_in(mode), by_itself=True),
        )

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
            preempt: End the one that runs instead of being refused; for what stops a drive.
            by_itself: No client has requested it, so no stream of targets is let in for it.
        """
        if self._leaving is not None:
            sequence.close()
            return self._leaving if preempt else _refused(self._ending())
        if preempt:
            self.cancel(f'{self._running} was ended by {name}')
        if self._busy:
            sequence.close()
            return _refused(DriveError(f'{self.drive.name} is busy: {self._running} is running'))
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

    def set_target(self, target: float) -> str:
        """Move to a position, at a velocity or with a torque, in the mode that is selected."""
        mode = self.drive.control.mode
        self._set(mode.set_target, target)
        self._stream.interrupt('a single target')
        return f'target {target:g} in mode {mode.number.title}'

    def deliver(self, command: Callable[[], str]) -> Promise[str]:
        """Run ``command``, which sets a target or a move.

        Done when the drive has it, and no halt keeps it.
        """
        return self._scheduler.spawn(self._delivered(command))

    async def _delivered(self, command: Callable[[], str]) -> str:
        control = self.drive.control
        mode, answer = control.mode, command()
        delivery, motion = self._delivery, self.drive.motions
        try:
            await self._taken(mode, delivery)
        except DriveError as error:  # a target that was reported as failed must not move it later
            if delivery.done and not isinstance(delivery.error, SdoTimeoutError):
                raise
            if mode.withdraw(delivery, error):
                raise DriveError(f'{error}; it is withdrawn') from error
            if control.accepts_targets and self.drive.motions == motion:
                control.hold()
            raise
        return answer

    async def _taken(self, mode: Mode, delivery: Promise[None]) -> None:
        """Wait until the drive has what was commanded in a mode, and no halt keeps it."""
        drive, steps = self.drive, self._steps
        control, halt = drive.control, drive.control.halt

        def stopped() -> bool:
            halted = halt.held and not halt.leaving
            led_away = drive.stop.running or not control.stays_enabled
            return halted or led_away or control.mode is not mode

        await steps.until(
            lambda: stopped() or (delivery.done and not halt.leaving),
            TAKEN_TIMEOUT + drive.node.config.sdo_timeout,
            'its target',
        )
        if delivery.error is not None:
            raise steps.refused(f'has not taken its target ({delivery.error})')
        if halt.unanswered:
            raise DriveError(f'{drive.name} stays halted: {NOT_TAKEN}')
        if stopped():
            raise steps.refused('was stopped before it had taken the target')

    async def arrive(self, command: Callable[[], str], timeout: float) -> str:
        """Run ``command``, which sets a target or a move, and wait until the drive stands there.

        One that is later than ``timeout`` in [s] is halted.

        Raises:
            DriveError: It is late, was stopped before, or got another target or mode.
        """
        drive, steps = self.drive, self._steps
        delivered = self.deliver(command)
        control, mode, motion = drive.control, drive.control.mode, drive.motions
        await delivered

        def lost() -> bool:
            halted = control.halted and not control.halt.leaving
            replaced = drive.motions != motion or control.mode is not mode
            return halted or replaced or not control.acts or not drive.view.fresh

        def arrived() -> bool:
            return mode.reached(drive.view.statusword) and drive.view.stands

        try:
            await self._scheduler.until(lambda: lost() or arrived(), timeout)
        except TimeoutError:
            if not lost():  # else the motion is that of somebody else
                late = f'{drive.name} has not arrived within {timeout:g} s'
                try:
                    late = f'{late}, and was halted: {await self.request("halt")}'
                except DriveError as error:
                    late = f'{late}, and was commanded to halt: {error}'
                raise DriveError(late) from None
        if lost():
            raise steps.refused('was stopped, or got another target, before it arrived')
        return drive.describe()

    def stream_target(self, target: float) -> None:
        """Follow a stream of targets; when it pauses for too long, the drive stops."""
        self._stream.admit()
        self._set(self.drive.control.mode.follow_target, target)
        self._stream.follow(self._delivery)

    def move(self, move: Move) -> str:
        """Hand a move to the drive in mode 1, with all that the mode offers.

        Raises:
            DriveError: Another mode is selected, or the drive cannot take it.
        """
        drive, mode = self.drive, self.drive.control.mode
        if not isinstance(mode, ProfilePosition):
            raise self._steps.refused('moves only in mode 1; select position_mode first')
        self._require_acceptance()
        if drive.control.halted and not drive.control.halt.leaving:
            move = replace(move, immediate=True)  # the halt has ended the moves before it
        destination = self._named(lambda: mode.destination(move))
        drive.control.check_target(destination)
        delivery = self._named(lambda: mode.move(move))
        self._stream.interrupt('a single move')
        self._resume(delivery)
        if not move.immediate:
            self._delivery = completed()  # answered when it is queued, not when its turn comes
        how = 'at once' if move.immediate and mode.waiting == 1 else 'after the moves before it'
        return f'to {destination:g}, {how}'

    async def init(self) -> str:
        """Reset a fault, enable, home where bus.yml has a method, and select no mode.

        A drive that refuses to have no mode is left in the one that it had, or bus.yml names.
        """
        drive, steps = self.drive, self._steps
        await steps.ready()
        drive.released(Refusal(RefusalCause.COMMANDED, 'init'))
        await steps.reset_fault()
        await steps.reach(DriveState.OPERATION_ENABLED)
        await steps.come_to_rest()
        homed = ''
        before = steps.mode_to_return_to()
        try:
            if drive.view.parameters.supports(OperationMode.HOMING):
                homed = await self._home_at_init()
            if steps.needs_mode and drive.control.mode.number is OperationMode.HOMING:
                await steps.return_to(before)
        finally:
            if drive.node.online and not steps.needs_mode:
                drive.control.select(drive.control.modes[OperationMode.NO_MODE])
                drive.control.halt.end_in(OperationMode.NO_MODE)
        mode = drive.control.mode.number
        hint = f', in mode {mode.title}, as it refuses to have none' if mode else SELECT_MODE
        return f'{drive.view.state.title}{homed}{hint}'

    async def enable(self) -> str:
        """Lead to Operation Enabled, without homing and without resetting a fault."""
        await self._steps.ready()
        self._steps.require_no_fault()
        await self._steps.reach(DriveState.OPERATION_ENABLED)
        return self._enabled()

    async def recover(self) -> str:
        """Reset a fault and lead to Operation Enabled, with no target left over."""
        await self._steps.ready()
        await self._steps.reset_fault()
        await self._steps.reach(DriveState.OPERATION_ENABLED)
        return self._enabled()

    def _enabled(self) -> str:
        """Describe an enabled drive; one that came back to the bus has lost its mode."""
        has_mode = self.drive.control.mode.number is not OperationMode.NO_MODE
        return self.drive.describe() + ('' if has_mode else SELECT_MODE)

    async def home(
        self,
        method: int | None = None,
        on_progress: Callable[[HomingProgress], None] | None = None,
    ) -> str:
        """Enable the drive if it is not, home it, and select the mode of before again.

        By a method of 0x6098, None for the one in the drive; ``on_progress`` gets each phase when
        it begins.
        """
        drive, steps = self.drive, self._steps
        await steps.ready()
        steps.require_no_fault()
        if on_progress is not None:
            on_progress(HomingProgress.ENABLING)
        await steps.reach(DriveState.OPERATION_ENABLED)
        before = steps.mode_to_return_to()
        try:
            answer = await home(steps, method, on_progress)
        except BaseException:  # also when it is cancelled, and there is no time to wait
            drive.control.select_back(before)
            raise
        await steps.return_to(before)
        return f'{answer}; {drive.describe()}'

    async def select_mode(self, number: OperationMode) -> str:
        """Switch the mode of operation; the drive is left as enabled as it was.

        Raises:
            DriveError: The drive is offline or faulted, lacks the mode, or does not switch.
        """
        drive = self.drive
        await self._steps.ready()
        self._steps.require_no_fault()
        mode = drive.control.modes.get(number)
        if mode is None or not drive.view.parameters.supports(number):
            raise DriveError(self._missing_mode(number))
        if drive.objects.mode_display == number and drive.control.mode is mode:
            return f'already in mode {number.title}; {drive.describe()}'
        await self._steps.switch(mode)
        enabled = drive.view.state is DriveState.OPERATION_ENABLED
        hint = '' if enabled else f'; not enabled, {self._steps.way_to_enable()}'
        return f'{drive.describe()}{hint}'

    async def _home_at_init(self) -> str:
        """Home where bus.yml has a method; return what was done, or what could be."""
        drive = self.drive
        if method := method_at_init(drive):
            return f', {await home(self._steps, method)}'
        stored = drive.view.parameters.homing_method
        if not stored:
            return ''
        return (
            f', not homed: method {stored} is set in the drive (0x6098), but not in bus.yml; call '
            '~/home if it has to be homed'
        )

    def _set(self, command: Callable[[float], Promise[None]], target: float) -> None:
        self._require_acceptance()
        self.drive.control.check_target(target)
        self._resume(self._named(lambda: command(target)))

    def _named(self, command: Callable[[], T]) -> T:
        """Command the mode; what it refuses gets the name of the drive."""
        try:
            return command()
        except DriveError as error:
            raise DriveError(f'{self.drive.name}: {error}') from error

    def _require_acceptance(self) -> None:
        drive, steps = self.drive, self._steps
        if self._leaving is not None:
            raise self._ending()
        if self._busy:
            raise steps.refused(f'takes no target while {self._running} is running')
        refusal = drive.control.refusal
        if refusal is None:
            return
        if refusal.cause in (RefusalCause.FAULT, RefusalCause.NOT_ENABLED):
            raise steps.refused(f'takes no target; {steps.way_to_enable()}')
        if refusal.cause is RefusalCause.MODE_CHANGE and isinstance(drive.control.mode, NoMode):
            return  # which refuses every target itself
        if refusal.cause is RefusalCause.OFFLINE:
            raise steps.refused('takes no target')  # whose description says why
        raise steps.refused(f'takes no target: it {refusal}')

    def _ending(self) -> DriveError:
        return DriveError(f'{self.drive.name} takes no command any more: the master is ending')

    def _resume(self, delivery: Promise[None]) -> None:
        self._delivery = delivery
        self.drive.motions += 1
        self.drive.control.halt.leave(self._scheduler.now, delivery)  # so that no old one revives
        self.drive.released(Refusal(RefusalCause.SINGLE_TARGET))

    async def _enable_in(self, mode: OperationMode) -> str:
        await self._steps.ready()
        await self._steps.reach(DriveState.OPERATION_ENABLED)
        if mode is OperationMode.NO_MODE or mode is OperationMode.HOMING:
            return self.drive.describe()
        return await self.select_mode(mode)

    def _missing_mode(self, number: OperationMode) -> str:
        drive = self.drive
        parameters = drive.view.parameters
        offered = ', '.join(
            mode.title for mode in drive.control.modes if mode and parameters.supports(mode)
        )
        if not parameters.supports(number):
            why = f'the drive does not have it (0x6502 is 0x{parameters.supported_modes:X})'
        else:
            target = TARGET_OBJECTS.get(number)
            place = (
                object_address(drive.objects.at(target[0])) if target is not None else 'its target'
            )
            why = f'{place} is in no RPDO of bus.yml; map it'
        return f'{drive.name} has no mode {number.title}: {why}; it has: {offered}'


def _refused(error: DriveError) -> Promise[str]:
    refused: Promise[str] = Promise()
    refused.reject(error)
    return refused
