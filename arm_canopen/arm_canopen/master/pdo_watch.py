# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Counts and reports the TPDOs of one device that do not come."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from .events import EventKind, Severity
from .process_image import ReceivedTpdo


class PdoWatch:
    """Counts the TPDOs that do not come, and reports once when they have stopped."""

    def __init__(
        self,
        inputs: Sequence[ReceivedTpdo],
        report: Callable[[EventKind, Severity, str], None],
    ) -> None:
        self.missed = 0  # TPDOs that did not answer a SYNC
        self._report = report
        self._inputs = inputs
        self._every_sync = [entry for entry in inputs if entry.every_sync]
        self._synchronous = {entry.config.number for entry in inputs if entry.synchronous}
        self._stopped: set[int] = set()
        self._may_get_lost = ''  # numbers of TPDOs, as at the last boot
        for entry in inputs:
            entry.on_short = self._report_short

    @property
    def last(self) -> float:
        """Steady time of the last TPDO in [s]; 0 before the first."""
        return max((entry.timestamp for entry in self._inputs), default=0.0)

    def stop(self) -> None:
        """The device went away."""
        self._stopped.clear()

    def warn_of_losses(self) -> None:
        """Report which TPDOs of a drive may get lost unnoticed, unless the last boot did."""
        numbers = ', '.join(
            str(entry.config.number) for entry in self._inputs if entry.loss_unnoticed
        )
        before, self._may_get_lost = self._may_get_lost, numbers
        if numbers and numbers != before:
            self._warn(
                f'TPDO {numbers}: its loss goes unnoticed, and the drive is led by what '
                'it sent before. Write transmission: 1 (with SYNC), or 255 and event_timer: 100 '
                'where the device has it'
            )

    def expect(self) -> None:
        """A SYNC is about to be sent: await those that answer each one."""
        for entry in self._every_sync:
            entry.expect()

    def excuse(self, late: float) -> None:
        """Await those that answer SYNC so many [s] longer, as it was not sent meanwhile."""
        for entry in self._inputs:
            if entry.synchronous:
                entry.excused += late

    def count_missed(self) -> None:
        """Count those that did not answer the last SYNC."""
        self.missed += sum(entry.awaited for entry in self._every_sync)

    def look(self, now: float) -> None:
        """Report those that have come and then stopped, at a steady time in [s]."""
        stopped = [
            entry for entry in self._inputs if entry.values is not None and entry.stale(now)
        ]
        if not stopped and not self._stopped:
            return
        numbers = {entry.config.number for entry in stopped}
        before, self._stopped = self._stopped, numbers
        if self._synchronous and self._synchronous <= numbers:
            if not self._synchronous <= before:
                longest = max(entry.stale_after for entry in stopped if entry.synchronous)
                self._warn(
                    f'has not answered SYNC for {longest * 1000:g} ms; targets are refused until '
                    'it does. Check its power and its cable'
                )
            numbers = numbers - self._synchronous
        for entry in stopped:
            if entry.config.number in numbers - before:
                self._warn(
                    f'TPDO {entry.config.number} (0x{entry.config.cob_id:03X}) has stopped: none '
                    f'for {entry.stale_after * 1000:g} ms; targets are refused until it comes '
                    'again'
                )

    def _report_short(self, entry: ReceivedTpdo, length: int) -> None:
        if entry.length_errors == 1:
            self._warn(
                f'TPDO {entry.config.number} (0x{entry.config.cob_id:03X}) has {length} bytes, '
                f'its mapping {entry.codec.size}; it is not used. Does the device have another '
                'mapping than bus.yml, or does somebody else send with this identifier?'
            )

    def _warn(self, text: str) -> None:
        self._report(EventKind.PDO, Severity.WARNING, text)
