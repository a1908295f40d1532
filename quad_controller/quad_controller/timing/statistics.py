# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of the control loop."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

PERCENTILE = 0.99


@dataclass(frozen=True, slots=True)
class LoopFigures:
    """What the loop did over the last window; counts since the start."""

    steps: int  # number of steps
    overruns: int  # steps that were left out
    rate: float  # mean number of steps in [1/s]
    jitter_p50: float  # median distance of an interval from the period in [s]
    jitter_p99: float  # its 99th percentile in [s]
    jitter_max: float  # the largest one in [s]
    duration_p99: float  # 99th percentile of the time that a step takes in [s]
    latency_p50: float  # median time from feedback to the command that uses it in [s]
    latency_p99: float  # its 99th percentile in [s]


class LoopStatistics:
    """Collects intervals, durations and latencies."""

    def __init__(self, period: float, window: int = 1000) -> None:
        """Start empty."""
        self._period = period
        self._intervals: deque[float] = deque(maxlen=window)
        self._durations: deque[float] = deque(maxlen=window)
        self._latencies: deque[float] = deque(maxlen=window)
        self._steps = 0

    def record(self, interval: float, duration: float, latency: float | None) -> None:
        """Add a step.

        Args:
            interval: Time since the step before in [s].
            duration: Time from its start until the command was published in [s].
            latency: Time from the feedback that it used to the command; None without one [s].
        """
        self._steps += 1
        self._intervals.append(interval)
        self._durations.append(duration)
        if latency is not None:
            self._latencies.append(latency)

    def copy(self) -> LoopStatistics:
        """Return what was collected so far, which no later step changes."""
        other = LoopStatistics(self._period)
        other._intervals = self._intervals.copy()
        other._durations = self._durations.copy()
        other._latencies = self._latencies.copy()
        other._steps = self._steps
        return other

    def figures(self, overruns: int) -> LoopFigures:
        """Return the figures of now.

        Args:
            overruns: Steps that were left out so far.
        """
        intervals = list(self._intervals)
        jitter = sorted(abs(interval - self._period) for interval in intervals)
        durations, latencies = sorted(self._durations), sorted(self._latencies)
        total = sum(intervals)
        return LoopFigures(
            steps=self._steps,
            overruns=overruns,
            rate=len(intervals) / total if total > 0.0 else 0.0,
            jitter_p50=_percentile(jitter, 0.5),
            jitter_p99=_percentile(jitter, PERCENTILE),
            jitter_max=_percentile(jitter, 1.0),
            duration_p99=_percentile(durations, PERCENTILE),
            latency_p50=_percentile(latencies, 0.5),
            latency_p99=_percentile(latencies, PERCENTILE),
        )


def _percentile(ordered: list[float], share: float) -> float:
    return ordered[int((len(ordered) - 1) * share)] if ordered else 0.0
