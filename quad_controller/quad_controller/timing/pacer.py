# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Steps at a fixed rate that fall, where they can, on the arrival of feedback; their figures.

The schedule is one of absolute times. As long as feedback comes, a step waits for it a little
beyond its time, and the schedule is drawn towards the arrivals: so the newest feedback is used
within a moment. Without feedback the steps are where the schedule has them. Either way the rate
stays the nominal one, within a few per cent of a feedback that is faster or slower.
"""

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


WINDOW = 0.08  # periods before and after its time in which feedback makes a step
GAIN = 0.2  # share of its distance from the schedule that an arrival draws the schedule by


class Pacer:
    """Says when the next step is due; times are those of a monotonic clock in [s]."""

    def __init__(self, period: float, now: float) -> None:
        """Make the first step due now."""
        self._period = period
        self._window = WINDOW * period
        self._due = now
        self._locked = False
        self.overruns = 0  # steps that were left out because the one before came too late

    def deadline(self, fresh: bool) -> float:
        """Return when a step is due at the latest.

        Args:
            fresh: Whether feedback is there that no step has used.
        """
        if fresh:
            return self._due
        return self._due + self._window if self._locked else self._due

    def takes(self, now: float) -> bool:
        """Return whether feedback that arrives now makes a step at once."""
        return now >= self._due - self._window

    def stepped(self, now: float, arrival: float | None) -> None:
        """Schedule the next step.

        Args:
            arrival: When the feedback arrived that it used, None without.
        """
        error = 0.0 if arrival is None else arrival - self._due
        error = min(max(error, -self._window), self._window)
        self._due += self._period + GAIN * error
        self._locked = arrival is not None
        late = now - self._due
        if late >= 0.0:
            skipped = int(late / self._period) + 1
            self.overruns += skipped
            self._due += skipped * self._period
