# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of the SYNC cycle."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

WINDOW = 2000  # cycles that the percentiles look back


@dataclass(frozen=True, slots=True)
class CycleFigures:
    """What the cycle did; jitter over the last window, counts since the start."""

    period: float  # nominal period in [s]
    cycles: int  # number of cycles
    overruns: int  # cycles that were left out because the one before ended too late
    jitter_p50: float  # median lateness of SYNC, when it has been handed to the bus, in [s]
    jitter_p99: float  # 99th percentile of the lateness in [s]
    jitter_max: float  # largest lateness in [s]


class CycleStatistics:
    """Collects the lateness of each cycle against its deadline."""

    def __init__(self, period: float, window: int = WINDOW) -> None:
        """The ``period`` is in [s]; the percentiles look back ``window`` cycles."""
        self._period = period
        self._late: deque[float] = deque(maxlen=window)
        self._cycles = 0
        self._overruns = 0

    def record(self, late: float, skipped: int) -> None:
        """Add a cycle: SYNC minus deadline in [s], and how many deadlines had passed."""
        self._late.append(late)
        self._cycles += 1
        self._overruns += skipped

    def figures(self) -> CycleFigures:
        """Return the figures of now."""
        ordered = sorted(self._late) or [0.0]
        last = len(ordered) - 1
        return CycleFigures(
            period=self._period,
            cycles=self._cycles,
            overruns=self._overruns,
            jitter_p50=ordered[last // 2],
            jitter_p99=ordered[last * 99 // 100],
            jitter_max=ordered[-1],
        )
