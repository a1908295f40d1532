# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether the TPDOs of one device come: those that answer SYNC, and those with an event time."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from .events import EventKind, Severity
from .process_image import Input

SILENCE_MAX = 0.5  # [s] without an answer to SYNC after which a device takes no targets


class PdoWatch:
    """Counts the TPDOs that do not come, and says it once when a device falls silent.

    Attributes:
        missed: TPDOs that did not answer a SYNC.
    """

    def __init__(
        self,
        inputs: Sequence[Input],
        report: Callable[[EventKind, Severity, str], None],
    ) -> None:
        """Begin with nothing awaited.

        Args:
            inputs: The TPDOs of the device.
            report: Takes what is wrong with them.
        """
        self.missed = 0
        self._report = report
        self._every_sync = [entry for entry in inputs if entry.every_sync]
        self._timed = [entry for entry in inputs if entry.deadline > 0.0]
        self._stopped: set[int] = set()
        self._answered_at = 0.0
        self._silent = False
        for entry in inputs:
            entry.on_short = self._tell_short

    def start(self, now: float) -> None:
        """The device came online at a time in [s]."""
        self._answered_at = now
        self._silent = False

    def stop(self) -> None:
        """The device went away."""
        self._stopped.clear()

    def answers(self, now: float) -> bool:
        """Tell whether all of them come, at a time in [s]."""
        silent = now - self._answered_at >= SILENCE_MAX
        return not (silent and self._every_sync) and not self._stopped

    def expect(self, now: float) -> None:
        """A SYNC is about to be sent at a time in [s]: await those that answer each one."""
        answered = False
        for entry in self._every_sync:
            if not entry.awaited:
                answered = True
            entry.expect()
        if answered:
            self._answered_at = now
            self._silent = False

    def count_missed(self, now: float, *, operational: bool) -> int:
        """Count those that did not answer the last SYNC, and return their number.

        Args:
            now: Steady time in [s].
            operational: The device should have answered.
        """
        missed = sum(entry.awaited for entry in self._every_sync)
        self.missed += missed
        if missed and operational and not self._silent and not self.answers(now):
            self._silent = True
            self._warn(
                f'has not answered SYNC for {SILENCE_MAX * 1000:g} ms, and takes no targets until '
                'it does; is it still there?'
            )
        return missed

    def look(self, now: float) -> None:
        """Look for those with an event time that have stopped, at a time in [s]."""
        for entry in self._timed:
            number = entry.config.number
            if entry.values is None or now - entry.timestamp <= entry.deadline:
                self._stopped.discard(number)
            elif number not in self._stopped:
                self._stopped.add(number)
                self._warn(
                    f'TPDO {number} has stopped: none for {entry.deadline * 1000:g} ms, though '
                    'its event timer says so; the device takes no targets until it comes again'
                )

    def _tell_short(self, entry: Input, length: int) -> None:
        if entry.length_errors == 1:
            self._warn(
                f'TPDO {entry.config.number} (0x{entry.config.cob_id:03X}) has {length} bytes, '
                f'its mapping {entry.codec.size}; it is not used. Does the device have another '
                'mapping than bus.yml, or does somebody else send with this identifier?'
            )

    def _warn(self, text: str) -> None:
        self._report(EventKind.PDO, Severity.WARNING, text)
