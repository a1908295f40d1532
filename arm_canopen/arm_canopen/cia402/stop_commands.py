# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The commands that stop an axis: disable, halt, quick stop and shutdown."""

from __future__ import annotations

from collections.abc import Coroutine
from contextlib import suppress
from typing import Any

from canopen_core import DriveError
from canopen_core.standard import DriveState

from ..master.scheduler import Promise, Scheduler
from .motion import Refusal, RefusalCause
from .steps import AxisSteps
from .stop import STOP_TIMEOUT

BRAKED_TIMEOUT = 10.0  # [s] for a halt to end in standstill, beside the time of the ramp


class StopCommands:
    """Disable, halt, quick stop and shutdown of one axis."""

    def __init__(self, steps: AxisSteps, scheduler: Scheduler) -> None:
        self._axis = steps.axis
        self._steps = steps
        self._scheduler = scheduler

    async def disable(self) -> str:
        """Lead to Switched On, as ros2_canopen's service does; the motor is without torque."""
        axis = self._axis
        if not await self._ready_to_stop('disabled'):
            return await self.shutdown()
        if axis.view.state is DriveState.OPERATION_ENABLED:
            await self._escalated(self._steps.reach(DriveState.SWITCHED_ON))
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
        await self._escalated(self._steps.come_to_halt(BRAKED_TIMEOUT))
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
            raise self._steps.refused(f'is {what}; cut its power')
        return axis.describe()

    async def _quick_stop(self) -> str:
        """Quick stop by whatever reaches the drive; one that goes on loses its power."""
        axis = self._axis
        axis.goal = DriveState.QUICK_STOP_ACTIVE
        await axis.stop.run(disables=False)
        if not axis.stop.rests:
            raise self._steps.refused('is not seen to come to rest; cut its power')
        return axis.describe()

    async def _escalated(self, stop: Coroutine[Promise[Any], None, None]) -> None:
        """Await a stop; where it does not end in rest, what follows it: a quick stop at least."""
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
        """Describe the drive when it was seen to stand, in [s] beside the time of the ramp.

        Waits for the end of what a halt leaves alone, too: a quick stop, the reaction to a fault.
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
        """End what moves the drive, now or later; True where PDOs can brake it."""
        axis = self._axis
        axis.interrupted = None
        axis.released(Refusal(RefusalCause.COMMANDED, reason))
        self._require_booted()
        if not axis.node.operational or axis.stop.running:
            return False
        try:
            await self._steps.ready(to_stop=True)
        except DriveError:
            return False  # it shows nothing, or not any more
        self._steps.require_no_fault()
        return True

    async def _stay_disabled(self) -> None:
        """Prevent enabling, also where the command for it is on its way."""
        axis, steps = self._axis, self._steps
        axis.leave_operation()
        await axis.stop.ended()
        await steps.settle()
        await steps.until(
            lambda: axis.view.state is not DriveState.OPERATION_ENABLED,
            steps.quirks.state_timeout,
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
