# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Quick stop, rest, disable: the one way in which the master takes an axis out of operation."""

from __future__ import annotations

from collections.abc import Callable

from ..exceptions import CodecError, SdoError
from ..master.events import Severity
from ..master.scheduler import Scheduler, Task
from ..standard.drive import DriveState, statusword_text
from ..standard.objects import Index
from .drive_view import DriveView, FAULTY
from .state_machine import Command

REACTION_TIME = 0.5  # [s] in which a drive shows that it has got a command by RPDO
STOP_TIMEOUT = 2.0  # [s] to come to rest, beside the time of the ramp
RAMP_MAX = 10.0  # [s] that a ramp may take on the way out; then the power goes all the same
SHUTDOWN_MAX = STOP_TIMEOUT + (STOP_TIMEOUT + RAMP_MAX) + STOP_TIMEOUT
"""Longest time of a shutdown in [s]: to begin the stop, to come to rest, to lose the power."""
DISABLED = (
    DriveState.SWITCH_ON_DISABLED,
    DriveState.NOT_READY_TO_SWITCH_ON,
    DriveState.UNKNOWN,
    *FAULTY,
)


class StopSequence:
    """Stops a drive and takes its power away; every step has a deadline.

    It looks at the process image itself, because it also serves drives whose part of the cycle
    fails. A drive that does not react is commanded by SDO; then no RPDO carries its controlword
    any more, which might enable it again. Where the SDO fails, the RPDO leaves again if it can.

    Attributes:
        goal: State that the drive is led to, whatever else is commanded; None while it does not
            run.
    """

    def __init__(
        self, view: DriveView, scheduler: Scheduler, report: Callable[[Severity, str], None]
    ) -> None:
        """Take the state of the drive and the time; nothing runs before :meth:`begin`.

        Args:
            view: The state of the drive.
            scheduler: Time.
            report: Takes what goes wrong.
        """
        self.goal: DriveState | None = None
        self._view = view
        self._log = report
        self._scheduler = scheduler
        self._task: Task[None] | None = None
        self._sdo_error = ''
        self._quiet = False

    @property
    def running(self) -> bool:
        """Whether it has begun and not ended."""
        return self.goal is not None

    @property
    def disabled(self) -> bool:
        """Whether the drive shows that its power is away, or shows nothing at all."""
        return self._view.objects.state in DISABLED

    def ramp_time(self) -> float:
        """Return how long it brakes in [s], by the slower of its ramps."""
        parameters = self._view.parameters
        ramp = min(parameters.quick_stop_deceleration, parameters.profile.deceleration)
        return min(RAMP_MAX, self._view.speed / ramp)

    def begin(self, *, quiet: bool = False) -> None:
        """Begin, unless it runs already; what kept the RPDO from the drive before may be over.

        Args:
            quiet: Do not report what goes wrong: it is tried again and again.
        """
        if not self.running:
            self._quiet = quiet
            self._view.objects.unmute_controlword()
            self.goal = DriveState.QUICK_STOP_ACTIVE
            self._task = self._scheduler.background(self._run())

    async def run(self) -> None:
        """Begin if need be, and wait for the end."""
        if self._quiet:
            self.abandon('begun anew')  # what has failed in it may work now
        self.begin()
        await self.ended()

    async def ended(self) -> None:
        """Wait until it does not run."""
        await self._within(SHUTDOWN_MAX, lambda: not self.running)

    def abandon(self, reason: str) -> None:
        """End it where it is."""
        if self._task is not None:
            self._task.cancel(SdoError(reason))
        self.goal = None

    def use_sdo(self) -> None:
        """Command the drive by SDO from now on, because its RPDO does not reach it."""
        objects = self._view.objects
        if objects.mutes_controlword:
            return
        objects.mute_controlword()
        if self.running:
            self._write()

    async def _run(self) -> None:
        """Lead through the steps; what holds already ends a step at once."""
        objects = self._view.objects
        self._sdo_error = ''
        deadline = self._scheduler.now + STOP_TIMEOUT + self.ramp_time()
        try:
            await self._lead(
                DriveState.QUICK_STOP_ACTIVE,
                lambda: objects.state is not DriveState.OPERATION_ENABLED,
            )
            if not await self._within(deadline - self._scheduler.now, self._rests):
                self._report_motion()
            await self._lead(DriveState.SWITCH_ON_DISABLED, lambda: self.disabled)
            if not await self._within(STOP_TIMEOUT, lambda: self.disabled):
                error = f' ({self._sdo_error})' if self._sdo_error else ''
                self._report(f'does not show that it is disabled{error}', '. Cut its power')
        finally:
            self.goal = None

    def _report_motion(self) -> None:
        """Report that it is not seen to rest: it moves, or sends nothing any more."""
        silence = self._scheduler.now - self._view.objects.timestamp
        if self._view.objects.fresh(self._scheduler.now):
            self._report('did not come to rest in time')
        else:
            self._report(
                f'has sent no TPDO for {silence:.1f} s, and is not seen to come to rest; last',
                '. Check its power and cable',
            )

    def _report(self, what: str, remedy: str = '') -> None:
        if not self._quiet:
            self._log(Severity.ERROR, f'{what}: {self._shown()}{remedy}')

    async def _lead(self, goal: DriveState, reacts: Callable[[], bool]) -> None:
        """Command a state, by SDO where the drive does not react to its RPDO."""
        self.goal = goal
        if self._view.objects.controlword_muted:
            self._write()
        elif not await self._within(REACTION_TIME, reacts):
            self.use_sdo()

    def _write(self) -> None:
        """Write the controlword of this step; the step does not wait for the answer."""
        quick_stop = self.goal is DriveState.QUICK_STOP_ACTIVE
        command = Command.QUICK_STOP if quick_stop else Command.DISABLE_VOLTAGE
        self._scheduler.background(self._written(command))

    async def _written(self, command: Command) -> None:
        objects = self._view.objects
        place = objects.at(Index.CONTROLWORD)
        try:
            await self._view.node.objects.write_object(place, 0, int(command), urgent=True)
        except (SdoError, CodecError) as error:
            self._sdo_error = str(error)
            if objects.mutes_controlword and objects.can_send(int(command)):
                objects.unmute_controlword()

    def _shown(self) -> str:
        view = self._view
        return f'{statusword_text(view.objects.statusword)}; {view.speed:.3g} per second'

    def _rests(self) -> bool:
        state = self._view.objects.state
        if state is DriveState.QUICK_STOP_ACTIVE:  # option codes 5 to 8 hold there
            return self._view.stands
        return state is not DriveState.OPERATION_ENABLED

    async def _within(self, timeout: float, condition: Callable[[], bool]) -> bool:
        try:
            await self._scheduler.until(condition, timeout)
        except TimeoutError:
            return False
        return True
