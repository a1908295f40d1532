# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Steps of commands to an axis; each waits for a condition and reports what was missing."""

from __future__ import annotations

from collections.abc import Callable
import contextlib

from canopen_core import CodecError, DriveError, SdoError, SdoTimeoutError
from canopen_core.standard import (
    DriveState,
    Index,
    object_address,
    OperationMode,
    Statusword,
    TORQUE_MODES,
)

from ..master.events import Severity
from ..master.scheduler import Scheduler
from .axis import Axis, NOT_TAKEN
from .modes import Mode, ProfilePosition
from .motion import Refusal, RefusalCause
from .parameters import quirks_of
from .state import FAULTY
from .stop import REACTION_TIME, RESUME_TIMEOUT, STOP_TIMEOUT

BUFFER_CLEAR = 6  # sub-index of 0x60C4 (CiA 402-2, clause 12)
BUFFER_EMPTY, BUFFER_OPEN = 0, 1
BUFFER_ATTEMPTS = 4
READY_TIMEOUT = 2.0  # [s] from operational to the first PDOs and parameters
REFUSED_SHARE = 0.5  # share of a time-out after which a drive counts as refusing
SETTLE_CYCLES = 3  # SYNC cycles until feedback shows the effect of a command


class AxisSteps:
    """Steps of commands to one axis."""

    def __init__(self, axis: Axis, scheduler: Scheduler) -> None:
        self.axis = axis
        self.quirks = quirks_of(axis.config.quirks)
        # the drive refuses mode 0, or Operation enabled in mode 0
        self.needs_mode = self.quirks.no_mode_zero
        self._scheduler = scheduler
        self._keeps_mode_under_halt = False

    @property
    def now(self) -> float:
        """Steady time in [s]."""
        return self._scheduler.now

    async def ready(self, *, to_stop: bool = False) -> None:
        """Wait for state and parameters of a drive that has just booted.

        With ``to_stop`` a drive without a fresh state is also ready.

        Raises:
            DriveError: It is offline, its stop runs or failed, or its state does not arrive.
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
        axis.controlword.send_again()  # what is commanded next goes by RPDO again

        def ready() -> bool:
            known = to_stop and axis.view.state is not DriveState.UNKNOWN
            seen = axis.view.ready and axis.is_up_to_date
            return known or seen or not axis.node.operational

        try:
            await self._scheduler.until(ready, READY_TIMEOUT)
        except TimeoutError:
            raise DriveError(self._why_not_ready()) from None
        if not to_stop and await axis.view.confirm():
            await self.settle()  # until the cycle has seen what lost TPDOs had
        self._require_operational()

    async def reach(self, goal: DriveState) -> None:
        """Bring the drive to a state and wait for it.

        Raises:
            DriveError: The state is not reached; the drive is then disabled. It is not enabled if
                it refuses the holding value.
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
                await self._leave_quick_stop(timeout)
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
        """Clear the cause of the last stop, and preload the actual position."""
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

    async def _leave_quick_stop(self, timeout: float) -> None:
        """Leave Quick stop active by transition 16, or by 12 if the drive lacks that.

        ABB's FEPL-02 lacks it (its table of commands). A drive that still brakes stays powered.
        """
        axis, view = self.axis, self.axis.view

        def left() -> bool:
            return view.state is not DriveState.QUICK_STOP_ACTIVE or self._is_hopeless()

        with contextlib.suppress(TimeoutError):
            await self._scheduler.until(lambda: left() or view.stands, timeout)
        for goal in (DriveState.OPERATION_ENABLED, DriveState.SWITCH_ON_DISABLED):
            if left() or not view.stands:
                return
            axis.goal = goal
            with contextlib.suppress(TimeoutError):
                await self._scheduler.until(left, REACTION_TIME)

    async def _select_where_required(self, timeout: float) -> None:
        """Select the mode of bus.yml for a drive that refuses Operation enabled in mode 0.

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
        """Return the mode to select after homing; mode 0 only if the drive accepts it."""
        axis = self.axis
        if axis.mode.number or not self.needs_mode:
            return axis.mode
        shown = axis.shown_mode
        if shown is not None and shown.number not in (OperationMode.NO_MODE, OperationMode.HOMING):
            return shown
        return self._configured_mode() or axis.mode

    async def return_to(self, mode: Mode) -> None:
        """Return to the mode before homing; tolerate a drive that refuses mode 0."""
        if mode.number and mode is not self.axis.mode:
            await self.switch(mode)
        elif not (mode.number or self.needs_mode):
            self.axis.select(mode)
            with contextlib.suppress(DriveError):
                await self.until(lambda: self.axis.shows_mode, self.quirks.mode_timeout, 'mode 0')

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

    async def _holding_torque(self, mode: Mode) -> int:
        """Return 0x6077 where only an SDO brings it; a mode that begins without drops a load."""
        axis, index = self.axis, self.axis.view.at(Index.TORQUE_ACTUAL)
        if axis.view.shows_torque:
            return 0
        torque: object = None
        try:
            if (index, 0) in axis.node.config.dictionary:
                torque = await axis.node.objects.read_object(index)
        except (SdoError, CodecError) as error:
            raise self.refused(
                'is not switched: it would drop its load, as the torque that holds it cannot be '
                f'read ({error}); map {object_address(index)} into a TPDO, or disable it, select '
                f'mode {mode.number.title}, and enable it again'
            ) from error
        if isinstance(torque, int):
            return torque
        axis.warn(
            f'begins mode {mode.number.title} without torque, and drops what it holds: its EDS '
            f'has no number at {object_address(index)}'
        )
        return 0

    async def come_to_rest(self) -> None:
        """Halt a moving drive before a mode switch would stop it abruptly; it stays halted.

        A torque stays commanded: removing it would drop a load.
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

        The ``timeout`` in [s] is added to the time of the ramp.

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
                self.quirks.state_timeout + axis.stop.ramp_time(),  # it may brake first (0x605E)
                'the end of the fault',
            )
        finally:
            axis.resetting = False
        axis.view.error = ''

    async def switch(self, mode: Mode) -> None:
        """Switch the mode in the state that bus.yml requires, then return to the previous state.

        Raises:
            DriveError: 0x6061 does not show the mode in time; the previous mode is restored.
        """
        axis = self.axis
        before, shown = axis.mode, axis.shown_mode
        enabled = axis.view.state is DriveState.OPERATION_ENABLED
        switching_state = axis.config.switching_state
        leave = enabled and switching_state is not DriveState.OPERATION_ENABLED
        axis.released(Refusal(RefusalCause.MODE_SELECTED, mode.number.title))
        await self.come_to_rest()
        try:
            if enabled and not leave and mode.number in TORQUE_MODES:
                axis.view.held_torque = await self._holding_torque(mode)
            await self._preload(mode, 'is not switched')
            if leave:
                await self.reach(switching_state)
            if mode.number is OperationMode.INTERPOLATED_POSITION:
                await self._clear_buffer()
            await self._show(mode)
        except BaseException:  # also when it is cancelled: it stays halted in either mode
            axis.select_back(before)
            raise
        finally:
            axis.view.held_torque = 0
        # else a move that was halted in it would go on; a homing begins with its start bit only
        if shown is not mode or mode.number is OperationMode.HOMING:
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
        """Clear bit 8 once the drive stands, when no older target can act."""
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
        """Clear and enable the buffer of mode 7, if the drive has one (0x60C4:06)."""
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
        """Write an object; return the error, or None."""
        try:
            await self.axis.node.objects.write_object(index, subindex, value)
        except SdoError as error:
            return error
        return None

    async def settle(self) -> None:
        """Wait until feedback shows the effect of the last command."""
        await self.pause(SETTLE_CYCLES * self.axis.period)

    async def pause(self, duration: float) -> None:
        """Wait for a time in [s]."""
        await self._scheduler.timer(duration)

    async def until(
        self, condition: Callable[[], bool], timeout: float, what: str, remedy: str = ''
    ) -> None:
        """Wait for a condition, described by ``what``, for at most ``timeout`` in [s].

        The error ends with ``remedy`` if no other reason for the time-out is known.

        Raises:
            DriveError: The condition is not met in time, or the drive faults or is lost before.
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
        """Raise a DriveError if the drive is faulted."""
        if self.axis.view.state in FAULTY:
            raise self.refused('is faulted; recover it first')

    def refused(self, what: str) -> DriveError:
        """Return an error that names the failure and the state of the axis."""
        return DriveError(f'{self.axis.name} {what}: {self.axis.describe()}')

    def way_to_enable(self) -> str:
        """Return how to enable the axis, in words."""
        return 'recover it' if self.axis.view.state in FAULTY else 'init or enable it'

    def _why(self) -> str:
        """Return which condition outside the bus prevents enabling, in words."""
        view = self.axis.view
        if view.undecoded is not None:
            return ' (its statusword shows no state of CiA 402)'
        word = view.statusword
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
        if axis.view.undecoded is not None:
            return (
                f'{axis.name} shows no state in its statusword: {axis.describe()}; do bits 0 to '
                '3, 5 and 6 of its 0x6041 follow CiA 402-2, table 31?'
            )
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
