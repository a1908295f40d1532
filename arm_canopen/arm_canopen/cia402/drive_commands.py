# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a person or client asks of a drive: sequences of many cycles, each with a spoken answer."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

from ..exceptions import DriveError
from ..master.events import Severity
from ..master.scheduler import Promise, Scheduler, Task
from ..standard.drive import DriveState, OperationMode, Statusword
from .drive import Drive, FAULTY
from .modes import CyclicPosition, Homing, Mode, NoMode

READY_TIMEOUT = 2.0  # [s] from operational to the first PDOs and parameters
STATE_TIMEOUT = 5.0  # [s] for all steps to a state, as ros2_canopen has it
MODE_TIMEOUT = 5.0  # [s] for 0x6061 to follow 0x6060
STOP_TIMEOUT = 2.0  # [s] to come to rest when leaving
REST_SHARE = 0.01  # share of the profile velocity below which an axis counts as standing
HOMING_START = 0.1  # [s] after which a drive has overwritten the homing bits of the last time


class DriveCommands:
    """The commands of one drive. Each returns what was reached, or raises DriveError.

    Attributes:
        drive: The drive.
    """

    def __init__(self, drive: Drive, scheduler: Scheduler) -> None:
        """Take the drive and the time."""
        self.drive = drive
        self._scheduler = scheduler
        self._running = ''
        self._task: Task[str] | None = None

    def run(
        self, name: str, sequence: Coroutine[Promise[Any], None, str], *, preempt: bool = False
    ) -> Promise[str]:
        """Run one of the coroutines below unless another one runs.

        Args:
            name: Name of the command, for messages.
            sequence: The coroutine.
            preempt: End the one that runs instead of being refused; for what stops a drive.
        """
        if preempt and self._task is not None:
            self._task.cancel(DriveError(f'{self._running} was ended by {name}'))
        if self._task is not None and not self._task.done:
            sequence.close()
            refused: Promise[str] = Promise()
            refused.reject(DriveError(f'{self.drive.name} is busy: {self._running} is running'))
            return refused
        self._running = name
        self._task = self._scheduler.spawn(sequence)
        return self._task

    def set_target(self, target: float) -> str:
        """Move to a position, or at a velocity, in the mode that is selected.

        Raises:
            DriveError: The drive cannot take it; the message says why.
        """
        drive = self.drive
        if drive.state is not DriveState.OPERATION_ENABLED:
            raise self._refused(f'takes no target; call {self._way_to_enable()}')
        if not isinstance(drive.mode, NoMode) and not drive.obeys:
            raise self._refused('takes no target now')
        if drive.mode.setpoint is not None:
            drive.check_limits(target)
        try:
            drive.mode.set_target(target)
        except DriveError as error:
            raise DriveError(f'{drive.name}: {error}') from error
        drive.released('a single target was commanded')
        return f'target {target:g} in mode {drive.mode.number.title}'

    async def init(self) -> str:
        """Reset a fault, enable, home if the drive has a homing method, and select no mode."""
        drive = self.drive
        await self._ready()
        drive.released('the drive is initialised')
        await self._reset_fault()
        await self._reach(DriveState.OPERATION_ENABLED)
        await self._come_to_rest()
        method = drive.parameters.homing_method
        homed = ''
        try:
            if method and drive.parameters.supports(OperationMode.HOMING):
                await self._home()
                homed = f', homed by method {method}'
        finally:
            if drive.node.online:
                drive.select(drive.modes[OperationMode.NO_MODE])
        return f'{drive.state.title}{homed}; select a mode before the first target'

    async def enable(self) -> str:
        """Lead to Operation Enabled, without homing and without resetting a fault."""
        await self._ready()
        self._require_no_fault()
        await self._reach(DriveState.OPERATION_ENABLED)
        return self.drive.describe()

    async def recover(self) -> str:
        """Reset a fault and lead to Operation Enabled, with no target left over."""
        await self._ready()
        await self._reset_fault()
        await self._reach(DriveState.OPERATION_ENABLED)
        return self.drive.describe()

    async def disable(self) -> str:
        """Lead to Switched On, as ros2_canopen's service does; the motor is without torque."""
        await self._ready()
        self._require_no_fault()
        self.drive.released('disabled')
        if self.drive.state is DriveState.OPERATION_ENABLED:
            await self._reach(DriveState.SWITCHED_ON)
        else:
            self.drive.goal = DriveState.SWITCH_ON_DISABLED
        return self.drive.describe()

    async def halt(self) -> str:
        """Quick stop; what follows depends on the drive's option code 0x605A."""
        drive = self.drive
        await self._ready()
        self._require_no_fault()
        drive.released('halted')
        if drive.state is not DriveState.OPERATION_ENABLED:
            drive.goal = DriveState.SWITCH_ON_DISABLED  # nor shall it be enabled any more
            return f'nothing to halt: {drive.describe()}'
        drive.goal = DriveState.QUICK_STOP_ACTIVE
        await self._until(
            lambda: drive.state is not DriveState.OPERATION_ENABLED,
            STATE_TIMEOUT,
            'the quick stop',
        )
        return drive.describe()

    async def select_mode(self, number: OperationMode) -> str:
        """Switch the mode of operation; the drive is left as enabled as it was.

        Raises:
            DriveError: The drive is offline or faulted, lacks the mode, or does not switch.
        """
        drive = self.drive
        await self._ready()
        self._require_no_fault()
        mode = drive.modes.get(number)
        if mode is None or not drive.parameters.supports(number):
            raise DriveError(self._missing_mode(number))
        if drive.objects.mode_display == number and drive.mode is mode:
            return f'already in mode {number.title}; {drive.describe()}'
        await self._switch(mode)
        enabled = drive.state is DriveState.OPERATION_ENABLED
        hint = '' if enabled else f'; not enabled, call {self._way_to_enable()}'
        return f'{drive.describe()}{hint}'

    async def shutdown(self) -> str:
        """Bring the drive to rest and take its power away; never raises."""
        drive = self.drive
        drive.released('shutting down')
        if drive.state is DriveState.OPERATION_ENABLED:
            drive.goal = DriveState.QUICK_STOP_ACTIVE
            await self._settled(lambda: drive.state is not DriveState.OPERATION_ENABLED)
        # option codes 5 to 8 hold in Quick Stop Active: wait for rest, then let go
        await self._settled(lambda: not self._moves_in_quick_stop())
        drive.goal = DriveState.SWITCH_ON_DISABLED
        await self._settled(lambda: drive.state is DriveState.SWITCH_ON_DISABLED)
        return drive.describe()

    async def _ready(self) -> None:
        drive = self.drive
        self._require_operational()
        try:
            await self._scheduler.until(
                lambda: drive.ready or not drive.node.operational, READY_TIMEOUT
            )
        except TimeoutError:
            raise DriveError(self._why_not_ready()) from None
        self._require_operational()

    def _require_operational(self) -> None:
        if not self.drive.node.operational:
            raise DriveError(f'{self.drive.name} is not operational: {self.drive.describe()}')

    def _why_not_ready(self) -> str:
        drive = self.drive
        if drive.state is DriveState.UNKNOWN:
            return (
                f'{drive.name} is operational, but its statusword, mode and position have not '
                'come; do its TPDOs follow SYNC, and does the bus.yml have a sync_period?'
            )
        return (
            f'{drive.name} has not answered the SDOs for its parameters (modes 0x6502, limits '
            f'0x607D, profile 0x6081): {drive.describe()}'
        )

    async def _reach(self, goal: DriveState) -> None:
        self.drive.goal = goal
        try:
            await self._until(lambda: self.drive.state is goal, STATE_TIMEOUT, goal.title)
        except BaseException:  # also when it is cancelled: nobody waits for the rest of the way
            self.drive.goal = DriveState.SWITCH_ON_DISABLED
            raise

    async def _come_to_rest(self) -> None:
        """Let the profile of a cyclic mode brake, which another mode would end with a jerk."""
        drive = self.drive
        mode = drive.mode
        if not drive.obeys or not isinstance(mode, CyclicPosition):
            return
        mode.brake()
        ramp = abs(mode.velocity) / drive.parameters.profile.deceleration  # [s]
        await self._until(lambda: mode.velocity == 0.0, STOP_TIMEOUT + ramp, 'standstill')

    async def _reset_fault(self) -> None:
        drive = self.drive
        if drive.state not in FAULTY:
            return
        drive.resetting = True
        try:
            await self._until(
                lambda: drive.state not in FAULTY, STATE_TIMEOUT, 'the end of the fault'
            )
        finally:
            drive.resetting = False
        drive.error = ''

    async def _switch(self, mode: Mode) -> None:
        """Switch in the state that bus.yml wants, then return to the state of before."""
        drive = self.drive
        before = drive.mode
        enabled = drive.state is DriveState.OPERATION_ENABLED
        switching_state = drive.node.config.drive.switching_state
        leave = enabled and switching_state is not DriveState.OPERATION_ENABLED
        drive.released(f'mode {mode.number.title} was selected')
        await self._come_to_rest()
        if leave:
            await self._reach(switching_state)
        drive.select(mode)
        try:
            await self._until(
                lambda: drive.objects.mode_display == mode.number,
                MODE_TIMEOUT,
                f'mode {mode.number.title} in 0x6061',
            )
        except DriveError:
            if drive.node.online:
                drive.select(before)
            raise
        if leave:
            await self._reach(DriveState.OPERATION_ENABLED)

    async def _home(self) -> None:
        drive = self.drive
        homing = drive.modes[OperationMode.HOMING]
        if not isinstance(homing, Homing):
            raise TypeError('mode 6 is no homing mode')
        await self._switch(homing)
        homing.started = True
        done = Statusword.HOMING_ATTAINED | Statusword.TARGET_REACHED

        def over() -> bool:
            word = drive.objects.statusword
            return bool(word & Statusword.HOMING_ERROR) or word & done == done

        try:
            await self._scheduler.timer(HOMING_START)
            await self._until(over, drive.node.config.drive.homing_timeout, 'the end of homing')
        finally:
            homing.started = False
        if drive.objects.statusword & Statusword.HOMING_ERROR:
            raise self._refused(f'failed to home by method {drive.parameters.homing_method}')

    async def _until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        drive = self.drive

        def hopeless() -> bool:
            return not drive.node.online or (drive.state in FAULTY and not drive.resetting)

        try:
            await self._scheduler.until(lambda: condition() or hopeless(), timeout)
        except TimeoutError:
            raise self._refused(f'did not reach {what} within {timeout:g} s') from None
        if not condition():
            await drive.know_error()
            raise self._refused(f'did not reach {what}')

    async def _settled(self, condition: Callable[[], bool]) -> None:
        """Wait for a condition on the way out; there is nobody to raise an error to."""
        drive = self.drive

        def settled() -> bool:
            return condition() or drive.state in (*FAULTY, DriveState.UNKNOWN)

        try:
            await self._scheduler.until(settled, STOP_TIMEOUT)
        except TimeoutError:
            drive.report(Severity.ERROR, f'did not come to rest in time: {drive.describe()}')

    def _moves_in_quick_stop(self) -> bool:
        drive = self.drive
        # a real encoder is never quite still, so slow enough counts as rest
        slow = REST_SHARE * drive.parameters.profile.velocity
        return drive.state is DriveState.QUICK_STOP_ACTIVE and abs(drive.velocity) > slow

    def _require_no_fault(self) -> None:
        if self.drive.state in FAULTY:
            raise self._refused('is faulted; call ~/recover first')

    def _refused(self, what: str) -> DriveError:
        return DriveError(f'{self.drive.name} {what}: {self.drive.describe()}')

    def _way_to_enable(self) -> str:
        return '~/recover' if self.drive.state in FAULTY else '~/init or ~/enable'

    def _missing_mode(self, number: OperationMode) -> str:
        drive = self.drive
        told = drive.parameters
        offered = ', '.join(mode.title for mode in drive.modes if mode and told.supports(mode))
        if not told.supports(number):
            why = f'the drive does not have it (0x6502 is 0x{told.supported_modes:X})'
        else:
            why = 'its target object is in no RPDO of bus.yml, or this master does not drive it'
        return f'{drive.name} has no mode {number.title}: {why}; it has: {offered}'
