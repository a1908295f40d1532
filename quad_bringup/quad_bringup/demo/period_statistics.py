# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How regularly a stream of messages was made, from their stamps."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
import math

KEPT = 3000
"""Intervals that are kept: one minute at 50 Hz."""


@dataclass(frozen=True, slots=True)
class PeriodFigures:
    """How regular a stream was.

    Attributes:
        rate: Messages per second, nan before there are two.
        jitter_p50: Median deviation of an interval from the period in [s].
        jitter_p99: 99th percentile of that in [s].
    """

    rate: float = math.nan
    jitter_p50: float = math.nan
    jitter_p99: float = math.nan


class PeriodStatistics:
    """Listens to the stamps of a stream."""

    def __init__(self, period: float) -> None:
        """Begin with none.

        Args:
            period: Time in [s] that there should be between two.
        """
        self._period = period
        self._last: float | None = None
        self._intervals: deque[float] = deque(maxlen=KEPT)

    def take(self, stamp: float) -> None:
        """Take in the stamp of the next message.

        Args:
            stamp: ROS time in [s].
        """
        if self._last is not None:
            self._intervals.append(stamp - self._last)
        self._last = stamp

    def figures(self) -> PeriodFigures:
        """Return how regular it was."""
        if not self._intervals:
            return PeriodFigures()
        total = sum(self._intervals)
        deviations = sorted(abs(each - self._period) for each in self._intervals)
        rate = len(deviations) / total if total > 0 else math.inf
        return PeriodFigures(rate, _percentile(deviations, 0.5), _percentile(deviations, 0.99))


def _percentile(ordered: list[float], share: float) -> float:
    return ordered[min(len(ordered) - 1, int(share * len(ordered)))]
