# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What stops a drive: sequences that end whatever else runs, and are never undone by it."""

from __future__ import annotations

from collections.abc import Coroutine
from contextlib import suppress
from typing import Any

from canopen_core import DriveError
from canopen_core.standard import DriveState

from ..master.scheduler import Promise, Scheduler
from .drive import Drive
from .refusal import Refusal, RefusalCause
from .sequences import DriveSequences
from .stop_sequence import STOP_TIMEOUT

BRAKED_TIMEOUT = 10.0  # [s] for a halt to end in standstill, beside the time of the ramp


class StopCommands:
    """Disable, halt, quick stop and shutdown of one drive."""

    def __init__(self, drive: Drive, steps: DriveSequences, scheduler: Scheduler) -> None:
        self._drive = drive
        self._steps = steps
        self._scheduler = scheduler

    async def disable(self) -> str:
        """Lead to Switched On, as ros2_canopen's service does; the motor is without torque."""
        drive = self._drive
        if not await self._ready_to_stop('disabled'):
            return await self.shutdown()
        if drive.view.state is DriveState.OPERATION_ENABLED:
            await self._escalated(self._steps.reach(DriveState.SWITCHED_ON))
        else:
            await self._stay_disabled()
        return await self._at_rest()

    async def halt(self) -> str:
        """Brake and stay enabled (bit 8, option code 0x605D); the next single target goes on.

        A drive that this does not slow down, or that no PDO reaches, gets a quick stop.
        """
        drive = self._drive
        if not await self._ready_to_stop('halted'):
            return await self._quick_stop()
        if self._is_quick_stopped():
            return f'nothing to halt: {await self._at_rest()}'
        if not drive.control.stays_enabled:
            await self._stay_disabled()
            return f'nothing to halt: {await self._at_rest()}'
        # whatever was about to lead it elsewhere
        drive.control.goal = DriveState.OPERATION_ENABLED
        await self._escalated(self._steps.halt(BRAKED_TIMEOUT))
        return drive.describe()

    async def quick_stop(self) -> str:
        """Quick stop; what follows at rest depends on the drive's option code 0x605A."""
        drive = self._drive
        reachable = await self._ready_to_stop('quick stop')
        if not reachable or drive.view.state is DriveState.OPERATION_ENABLED:
            return await self._quick_stop()
        if not self._is_quick_stopped():
            await self._stay_disabled()
        return f'nothing to stop: {await self._at_rest()}'

    async def shutdown(self) -> str:
        """Bring the drive to rest and take its power away.

        Raises:
            DriveError: It was not seen to rest without power.
        """
        drive = self._drive
        drive.interrupted = None
        drive.released(Refusal(RefusalCause.SHUTDOWN))
        self._require_booted()
        drive.control.goal = DriveState.SWITCH_ON_DISABLED
        await drive.stop.run()
        if not await drive.stop.confirmed():
            what = 'not seen to come to rest' if drive.stop.disabled else 'not disabled'
            raise self._steps.refused(f'is {what}; cut its power')
        return drive.describe()

    async def _quick_stop(self) -> str:
        """Quick stop by whatever reaches the drive; one that goes on loses its power."""
        drive = self._drive
        drive.control.goal = DriveState.QUICK_STOP_ACTIVE
        await drive.stop.run(disables=False)
        if not drive.stop.rests:
            raise self._steps.refused('is not seen to come to rest; cut its power')
        return drive.describe()

    async def _escalated(self, stop: Coroutine[Promise[Any], None, None]) -> None:
        """Await a stop; where it does not slow the drive down, the end of what follows it."""
        drive = self._drive
        try:
            await stop
        except DriveError:
            if not drive.stop.running:
                raise
            await drive.stop.ended()
            if not drive.stop.rests:
                raise

    async def _at_rest(self) -> str:
        """Describe the drive when it was seen to stand."""
        view = self._drive.view
        timeout = STOP_TIMEOUT + self._drive.stop.ramp_time()
        with view.looking(), suppress(TimeoutError):
            await self._scheduler.until(lambda: view.stands, timeout)
        if not view.stands:
            raise self._steps.refused('is not seen to come to rest; cut its power')
        return self._drive.describe()

    def _require_booted(self) -> None:
        if not self._drive.node.was_booted:
            raise self._steps.refused('is not known to stand, as it was never booted')

    async def _ready_to_stop(self, reason: str) -> bool:
        """End what moves the drive, now or later; True where PDOs can brake it."""
        drive = self._drive
        drive.interrupted = None
        drive.released(Refusal(RefusalCause.COMMANDED, reason))
        self._require_booted()
        if not drive.node.operational or drive.stop.running:
            return False
        try:
            await self._steps.ready(to_stop=True)
        except DriveError:
            return False  # it shows nothing, or not any more
        self._steps.require_no_fault()
        return True

    async def _stay_disabled(self) -> None:
        """Prevent enabling, also where the command for it is on its way."""
        drive, steps = self._drive, self._steps
        drive.leave_operation()
        await drive.stop.ended()
        await steps.settle()
        await steps.until(
            lambda: drive.view.state is not DriveState.OPERATION_ENABLED,
            steps.quirks.state_timeout,
            DriveState.SWITCH_ON_DISABLED.title,
        )

    def _is_quick_stopped(self) -> bool:
        """Whether a quick stop runs or has ended; then no lesser stop takes its place."""
        drive = self._drive
        quick_stop = DriveState.QUICK_STOP_ACTIVE
        if drive.view.state is not quick_stop and drive.control.goal is not quick_stop:
            return False
        drive.control.goal = quick_stop
        return True
