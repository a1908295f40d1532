# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What stops a drive: sequences that end whatever else runs, and are never undone by it."""

from __future__ import annotations

from ..config.model.drive import RecoveryPolicy
from ..exceptions import DriveError
from ..standard.drive import DriveState
from .drive import Drive
from .refusal import Refusal, RefusalCause
from .sequences import DriveSequences

BRAKED_TIMEOUT = 10.0  # [s] for a halt to end in standstill, beside the time of the ramp


class StopCommands:
    """Disable, halt, quick stop and shutdown of one drive."""

    def __init__(self, drive: Drive, steps: DriveSequences) -> None:
        self._drive = drive
        self._steps = steps

    async def disable(self) -> str:
        """Lead to Switched On, as ros2_canopen's service does; the motor is without torque."""
        drive = self._drive
        await self._ready_to_stop('disabled')
        if drive.view.state is DriveState.OPERATION_ENABLED:
            await self._steps.reach(DriveState.SWITCHED_ON)
        else:
            await self._stay_disabled()
        return drive.describe()

    async def halt(self) -> str:
        """Brake and stay enabled (bit 8, option code 0x605D); the next single target goes on."""
        drive = self._drive
        await self._ready_to_stop('halted')
        if self._is_quick_stopped():
            return f'nothing to halt: {drive.describe()}'
        if not drive.control.stays_enabled:
            await self._stay_disabled()
            return f'nothing to halt: {drive.describe()}'
        # whatever was about to lead it elsewhere
        drive.control.goal = DriveState.OPERATION_ENABLED
        await self._steps.halt(BRAKED_TIMEOUT)
        return drive.describe()

    async def quick_stop(self) -> str:
        """Quick stop; what follows depends on the drive's option code 0x605A."""
        drive, steps = self._drive, self._steps
        await self._ready_to_stop('quick stop')
        if drive.view.state is DriveState.OPERATION_ENABLED:
            drive.control.goal = DriveState.QUICK_STOP_ACTIVE
            await steps.until(
                lambda: drive.view.state is not DriveState.OPERATION_ENABLED,
                steps.quirks.state_timeout,
                'the quick stop',
            )
            return drive.describe()
        if not self._is_quick_stopped():
            await self._stay_disabled()
        return f'nothing to stop: {drive.describe()}'

    async def shutdown(self) -> str:
        """Bring the drive to rest and take its power away.

        Raises:
            DriveError: It does not show that its power is away.
        """
        drive = self._drive
        drive.interrupted = None
        drive.released(Refusal(RefusalCause.SHUTDOWN))
        drive.control.goal = DriveState.SWITCH_ON_DISABLED
        await drive.stop.run()
        if not drive.stop.disabled:
            raise self._steps.refused('is not disabled; cut its power')
        return drive.describe()

    async def _ready_to_stop(self, reason: str) -> None:
        """Take the drive from whatever moves it, or would do so when it comes back.

        Raises:
            DriveError: It is offline or faulted.
        """
        drive = self._drive
        returning = drive.interrupted is not None and drive.config.recovery is RecoveryPolicy.AUTO
        drive.interrupted = None
        try:
            await self._steps.ready(to_stop=True)
        except DriveError as error:
            if not returning:
                raise
            raise DriveError(f'{error}; it will not be enabled when it comes back') from error
        self._steps.require_no_fault()
        drive.released(Refusal(RefusalCause.COMMANDED, reason))

    async def _stay_disabled(self) -> None:
        """Have it enabled no more, also where the command for that is on its way already."""
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
