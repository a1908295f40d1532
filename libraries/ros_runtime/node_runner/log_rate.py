# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How often one line of the code may log, so that a defect in a cycle floods no log."""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass

BURST = 10  # records of one source within a window
WINDOW = 1.0  # [s]


@dataclass(slots=True)
class _Window:
    begin: float
    admitted: int = 0
    suppressed: int = 0


class LogRateLimit:
    """Admits the first records of each source in a window, and counts the others.

    Times are on the steady clock in [s].
    """

    def __init__(self, burst: int = BURST, window: float = WINDOW) -> None:
        self._burst = burst
        self._window = window
        self._windows: dict[Hashable, _Window] = {}

    def admit(self, source: Hashable, now: float) -> bool:
        """Return whether a record may be logged."""
        window = self._windows.setdefault(source, _Window(now))
        if window.admitted >= self._burst:
            window.suppressed += 1
            return False
        window.admitted += 1
        return True

    def collect(self, now: float) -> dict[Hashable, int]:
        """End the windows that are over; return how many records each source lost in them."""
        over = [
            source
            for source, window in self._windows.items()
            if now - window.begin >= self._window
        ]
        ended = {source: self._windows.pop(source) for source in over}
        return {source: window.suppressed for source, window in ended.items() if window.suppressed}

    @property
    def idle(self) -> bool:
        """Whether no window is open."""
        return not self._windows
