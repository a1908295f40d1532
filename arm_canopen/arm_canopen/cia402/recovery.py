# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What becomes of a drive whose device was lost in operation, when it comes back."""

from __future__ import annotations

from collections.abc import Callable

from ..config.model.drive import RecoveryPolicy
from ..exceptions import DriveError
from ..master.events import Severity
from ..master.scheduler import Promise, Scheduler
from ..standard.drive import OperationMode
from .drive import Drive
from .drive_view import FAULTY


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
