# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Commands to an axis: coroutines that run for many cycles and return a text for the client.

First scheduling and the delivery of targets, then the commands. ``steps.py`` has their steps,
``sequences.py`` the commands for stops and homing.
"""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from contextlib import suppress
from dataclasses import replace
import math
from typing import Any, TypeAlias, TypeVar

from canopen_core import DriveError, SdoTimeoutError
from canopen_core.standard import DriveState, Index, object_address, OperationMode, TARGET_OBJECTS

from ..config.model.drive import RecoveryPolicy
from ..master.events import Severity
from ..master.scheduler import completed, Promise, Scheduler, Task
from .axis import Axis, NOT_TAKEN
from .modes import Mode, Move, NoMode, ProfilePosition
from .motion import Refusal, RefusalCause
from .sequences import home, HomingProgress, StopCommands, TargetStream
from .state import FAULTY
from .steps import AxisSteps
from .stop import HaltState, RESUME_TIMEOUT

T = TypeVar('T')
Sequence: TypeAlias = Callable[[], Coroutine[Promise[Any], None, str]]

SELECT_MODE = '; select a mode before the first target'
SETTLING_TIME = 0.5  # [s] to settle at the target after standstill
WAY_SHARE = 0.02  # smallest arrival tolerance, as a share of the distance
WINDOW_INCREMENTS = 10  # [inc] smallest arrival tolerance
SAG_TOLERANCES = 5.0  # accepted offset of an axis under load, in arrival tolerances
TAKEN_TIMEOUT = RESUME_TIMEOUT + 1.0  # [s] for the drive to take a target and leave its halt


class AxisCommands:
    """Commands of one axis; each returns its result as text, or raises DriveError."""

    def __init__(self, axis: Axis, scheduler: Scheduler) -> None:
        self.axis = axis
        self._steps = AxisSteps(axis, scheduler)
        self.stops = StopCommands(self._steps, scheduler)  # commands that stop it
        self._stopping: dict[str, Sequence] = {
            'disable': self.stops.disable,
            'halt': self.stops.halt,
            'quick_stop': self.stops.quick_stop,
            'shutdown': self.stops.shutdown,
        }
        # commands without arguments by name, for :meth:`request`
        self.offered: dict[str, Sequence] = {
            'init': self.init,
            'enable': self.enable,
            'recover': self.recover,
            'home': self.home,
            **self._stopping,
        }
        self._scheduler = scheduler
        self.stop_count = 0  # number of stop commands
        self._running = ''
        self._delivery = completed()  # delivery of the last target or move
        self._task: Task[str] | None = None
        self._leaving: Promise[str] | None = None  # shutdown before the master ends
        self._stream = TargetStream(axis, scheduler, self._steps.settle)
        axis.on_ready = self._go_on

    # Scheduling of commands.

    def request(self, name: str) -> Promise[str]:
        """Run a command by name; a stop command cancels the running command."""
        return self.run(name, self.offered[name](), preempt=name in self._stopping)

    def run(
        self,
        name: str,
        sequence: Coroutine[Promise[Any], None, str],
        *,
        preempt: bool = False,
        by_itself: bool = False,
    ) -> Promise[str]:
        """Run one of the coroutines below, unless another one is running.

        Args:
            name: Name of the command, for messages.
            sequence: The coroutine.
            preempt: Cancel the running command instead of being refused; for stop commands.
            by_itself: No client requested it, so it does not re-admit a stream of targets.
        """
        if self._leaving is not None:
            sequence.close()
            return self._leaving if preempt else _refused(self._ending())
        if preempt:
            self.stop_count += 1
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
        """Shut down for good: later stop commands share the result, others are refused."""
        self._leaving = self.request('shutdown')
        return self._leaving

    def cancel(self, reason: str) -> None:
        """Cancel the running command, if any."""
        if self._task is not None:
            self._task.cancel(DriveError(reason))

    @property
    def _busy(self) -> bool:
        """Whether a command runs."""
        return self._task is not None and not self._task.done

    @property
    def stopping(self) -> Promise[str] | None:
        """The running stop command, if any."""
        if self._leaving is not None:
            return self._leaving
        return self._task if self._busy and self._running in self._stopping else None

    # Targets and moves.

    def set_target(self, target: float) -> str:
        """Command a position, velocity or torque in the selected mode; return a description."""
        mode = self.axis.mode
        self._set(mode.set_target, target)
        self._stream.interrupt('a single target')
        return f'target {target:g} in mode {mode.number.title}'

    def deliver(self, command: Callable[[], str]) -> Promise[str]:
        """Run ``command``, which sets a target or a move.

        The promise is done when the drive has it and no halt holds the axis.
        """
        return self._scheduler.spawn(self._delivered(command))

    async def _delivered(self, command: Callable[[], str]) -> str:
        axis = self.axis
        mode, answer = axis.mode, command()
        delivery, motion = self._delivery, axis.motions
        try:
            await self._taken(mode, delivery)
        except DriveError as error:  # a target reported as failed must not move the axis later
            if delivery.done and not isinstance(delivery.error, SdoTimeoutError):
                raise
            if isinstance(mode, ProfilePosition):
                mode.withdraw(delivery, error)
                raise DriveError(f'{error}; it is withdrawn') from error
            if axis.accepts_targets and axis.motions == motion:
                axis.hold()
            raise
        return answer

    async def _taken(self, mode: Mode, delivery: Promise[None]) -> None:
        """Wait until the drive has the target of a mode, and no halt holds the axis."""
        axis = self.axis
        halt = axis.halt

        def stopped() -> bool:
            led_away = axis.stop.running or not axis.stays_enabled
            return halt.rests or led_away or axis.mode is not mode

        await self._steps.until(
            lambda: stopped() or (delivery.done and not halt.leaving),
            TAKEN_TIMEOUT + axis.node.config.sdo_timeout,
            'its target',
        )
        if halt.state is HaltState.UNANSWERED:
            raise DriveError(f'{axis.name} stays halted: {NOT_TAKEN}')
        error = delivery.error
        if error is not None and not (stopped() and isinstance(error, DriveError)):
            raise self._steps.refused(f'has not taken its target ({error})')
        if stopped():
            raise self._steps.refused('was stopped before it had taken the target')

    async def arrive(self, command: Callable[[], str], timeout: float) -> str:
        """Run ``command``, which sets a target or a move, and wait for standstill at the target.

        An axis that needs longer than ``timeout`` in [s], or stands elsewhere, is halted.

        Raises:
            DriveError: It is late, was stopped, got another target or mode, or stands
                elsewhere.
        """
        axis = self.axis
        start = axis.view.position
        delivered = self.deliver(command)
        mode, motion = axis.mode, axis.motions
        await delivered

        def replaced() -> bool:
            other = axis.motions != motion or axis.mode is not mode
            return other or not axis.acts or not axis.view.fresh

        def lost() -> bool:
            return axis.halt.rests or replaced()

        def arrived() -> bool:
            return mode.reached(axis.view.statusword) and axis.view.stands

        ended = 'was stopped, or got another target, before it arrived'
        try:
            await self._scheduler.until(lambda: lost() or arrived(), timeout)
        except TimeoutError:
            if not lost():  # else the motion belongs to another client
                raise await self._halted(f'has not arrived within {timeout:g} s') from None
        if lost():
            raise self._steps.refused(ended)
        tolerance = self._tolerance(start)
        elsewhere = await self._elsewhere(tolerance, replaced)
        if replaced():
            raise self._steps.refused(ended)
        if elsewhere and axis.halt.rests:
            raise self._steps.refused(elsewhere)
        if elsewhere:
            window = min(
                axis.view.parameters.following_window or math.inf, SAG_TOLERANCES * tolerance
            )
            # keep the set-point under load, else the axis would sag further
            sags = mode.cyclic and abs(axis.following_error) <= window
            (axis.hold if sags else axis.hold_here)()
            raise await self._halted(elsewhere)
        return axis.describe()

    def _tolerance(self, start: float) -> float:
        """Return the arrival tolerance for a motion from ``start``, in user units."""
        view = self.axis.view
        return max(
            view.parameters.position_window or 0.0,
            WAY_SHARE * abs(self.axis.setpoint - start),
            WINDOW_INCREMENTS / abs(view.units.position.to_dev),
        )

    async def _elsewhere(self, tolerance: float, replaced: Callable[[], bool]) -> str:
        """Describe where an axis stands; return an empty text if it is at its target.

        The drive may have clamped the target to its own limits, and in the cyclic modes no bit
        shows the arrival.
        """
        axis = self.axis
        target, view, is_placed = axis.setpoint, axis.view, axis.mode.setpoint is not None

        def in_place() -> bool:
            return not is_placed or abs(view.position - target) <= tolerance

        with suppress(TimeoutError):
            await self._scheduler.until(lambda: replaced() or in_place(), SETTLING_TIME)
        if in_place():
            return ''
        return (
            f'stands at {view.position:.6g}, not at its target {target:.6g} (is it blocked, or '
            'within limits of its own?)'
        )

    async def _halted(self, failure: str) -> DriveError:
        """Halt an axis whose motion failed; return the error with the result of the halt."""
        text = f'{self.axis.name} {failure}'
        try:
            return DriveError(f'{text}, and was halted: {await self.request("halt")}')
        except DriveError as error:
            return DriveError(f'{text}, and was commanded to halt: {error}')

    def stream_target(self, target: float) -> None:
        """Follow a stream of targets; stop the drive if it pauses for too long."""
        self._stream.admit()
        self._set(self.axis.mode.follow_target, target)
        self._stream.follow(self._delivery)

    def move(self, move: Move) -> str:
        """Command a move in mode 1, with all options of the mode; return a description.

        Raises:
            DriveError: Another mode is selected, or the drive cannot take the move.
        """
        axis, mode = self.axis, self.axis.mode
        if not isinstance(mode, ProfilePosition):
            raise self._steps.refused('moves only in mode 1; select position_mode first')
        self._require_acceptance()
        if axis.halt.rests:
            move = replace(move, immediate=True)  # the halt has cancelled earlier moves
        destination = self._named(lambda: mode.destination(move))
        axis.check_target(destination)
        delivery = self._named(lambda: mode.move(move))
        self._stream.interrupt('a single move')
        self._resume(delivery)
        if not move.immediate:
            self._delivery = completed()  # done when queued, not when started
        how = 'at once' if move.immediate and mode.waiting == 1 else 'after the moves before it'
        return f'to {destination:g}, {how}'

    def _set(self, command: Callable[[float], Promise[None]], target: float) -> None:
        self._require_acceptance()
        self.axis.check_target(target)
        self._resume(self._named(lambda: command(target)))

    def _named(self, command: Callable[[], T]) -> T:
        """Run a command of the mode; add the name of the axis to its errors."""
        try:
            return command()
        except DriveError as error:
            raise DriveError(f'{self.axis.name}: {error}') from error

    def _require_acceptance(self) -> None:
        axis = self.axis
        if self._leaving is not None:
            raise self._ending()
        if self._busy:
            raise self._steps.refused(f'takes no target while {self._running} is running')
        refusal = axis.refusal
        if refusal is None:
            return
        if refusal.cause in (RefusalCause.FAULT, RefusalCause.NOT_ENABLED):
            raise self._steps.refused(f'takes no target; {self._steps.way_to_enable()}')
        if refusal.cause is RefusalCause.MODE_CHANGE and isinstance(axis.mode, NoMode):
            return  # mode 0 refuses every target itself
        if refusal.cause is RefusalCause.OFFLINE:
            raise self._steps.refused('takes no target')  # the error describes why
        raise self._steps.refused(f'takes no target: it {refusal}')

    def _ending(self) -> DriveError:
        return DriveError(f'{self.axis.name} takes no command any more: the master is ending')

    def _resume(self, delivery: Promise[None]) -> None:
        self._delivery = delivery
        self.axis.motions += 1
        self.axis.halt.leave(self._scheduler.now, delivery)  # so that no old target resumes
        self.axis.released(Refusal(RefusalCause.SINGLE_TARGET))

    # The commands, except those of ``sequences.py``.

    async def init(self) -> str:
        """Reset a fault, enable, home if bus.yml sets a method, and select mode 0.

        A drive that refuses mode 0 keeps its mode, or gets the one in bus.yml.
        """
        axis = self.axis
        await self._steps.ready()
        axis.released(Refusal(RefusalCause.COMMANDED, 'init'))
        await self._steps.reset_fault()
        await self._steps.reach(DriveState.OPERATION_ENABLED)
        await self._steps.come_to_rest()
        homed = ''
        before = self._steps.mode_to_return_to()
        try:
            if axis.view.parameters.supports(OperationMode.HOMING):
                homed = await self._home_at_init()
            if self._steps.needs_mode and axis.mode.number is OperationMode.HOMING:
                await self._steps.return_to(before)
        except BaseException:  # a drive may keep moving although bit 4 is cleared
            if axis.node.online and axis.view.state is DriveState.OPERATION_ENABLED:
                axis.hold()
            raise
        finally:
            if axis.node.online and not self._steps.needs_mode:
                axis.select(axis.modes[OperationMode.NO_MODE])
                axis.halt.end_in(OperationMode.NO_MODE)
        mode = axis.mode.number
        hint = f', in mode {mode.title}, as it refuses to have none' if mode else SELECT_MODE
        return f'{axis.view.state.title}{homed}{hint}'

    async def enable(self) -> str:
        """Enable the drive without homing it or resetting a fault."""
        await self._steps.ready()
        self._steps.require_no_fault()
        await self._steps.reach(DriveState.OPERATION_ENABLED)
        return self._enabled()

    async def recover(self) -> str:
        """Reset a fault and enable the drive; earlier targets are discarded."""
        await self._steps.ready()
        await self._steps.reset_fault()
        await self._steps.reach(DriveState.OPERATION_ENABLED)
        return self._enabled()

    def _enabled(self) -> str:
        """Describe an enabled drive; after a loss of its device, it has no mode."""
        has_mode = self.axis.mode.number is not OperationMode.NO_MODE
        return self.axis.describe() + ('' if has_mode else SELECT_MODE)

    async def home(
        self,
        method: int | None = None,
        notify: Callable[[HomingProgress], None] = lambda progress: None,
    ) -> str:
        """Enable the drive if necessary, home it, and return to the previous mode.

        ``method`` is a value of 0x6098, None for the one in the drive. ``notify`` is called when a
        phase begins.
        """
        axis = self.axis
        await self._steps.ready()
        self._steps.require_no_fault()
        notify(HomingProgress.ENABLING)
        await self._steps.reach(DriveState.OPERATION_ENABLED)
        before = self._steps.mode_to_return_to()
        try:
            answer = await home(self._steps, method, notify)
        except BaseException:  # also on cancellation, when there is no time to wait
            axis.select_back(before)
            raise
        await self._steps.return_to(before)
        return f'{answer}; {axis.describe()}'

    async def select_mode(self, number: OperationMode) -> str:
        """Switch the mode of operation; the drive stays enabled or disabled.

        Raises:
            DriveError: The drive is offline or faulted, lacks the mode, or does not switch.
        """
        axis = self.axis
        await self._steps.ready()
        self._steps.require_no_fault()
        mode = axis.modes.get(number)
        if mode is None or not axis.view.parameters.supports(number):
            raise DriveError(self._missing_mode(number))
        if axis.view.mode == number and axis.mode is mode:
            return f'already in mode {number.title}; {axis.describe()}'
        await self._steps.switch(mode)
        enabled = axis.view.state is DriveState.OPERATION_ENABLED
        hint = '' if enabled else f'; not enabled, {self._steps.way_to_enable()}'
        return f'{axis.describe()}{hint}'

    async def _home_at_init(self) -> str:
        """Home the drive if bus.yml sets a method; return what was done, or a hint."""
        axis = self.axis
        write = axis.node.config.write_of(axis.view.at(Index.HOMING_METHOD), 0)
        if write is not None and (method := int.from_bytes(write.data, 'little', signed=True)):
            return f', {await home(self._steps, method)}'
        stored = axis.view.parameters.homing_method
        if not stored:
            return ''
        return (
            f', not homed: method {stored} is set in the drive (0x6098), but not in bus.yml; call '
            '~/home if it has to be homed'
        )

    def _go_on(self) -> None:
        """Re-enable it in its mode before a loss, if bus.yml sets that as ``recovery``."""
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
        await self._steps.ready()
        await self._steps.reach(DriveState.OPERATION_ENABLED)
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


def _refused(error: DriveError) -> Promise[str]:
    refused: Promise[str] = Promise()
    refused.reject(error)
    return refused
