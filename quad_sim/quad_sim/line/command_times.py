# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""When joint commands come, as the robot at the end of its serial line sees it."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
import math

WINDOW = 20_000  # commands that are looked back


@dataclass(frozen=True, slots=True)
class CommandTiming:
    """Of joint commands on the wire; percentiles of nothing are NaN."""

    # times from the last byte of a state to the first byte of the next command in [s]
    latencies: tuple[float, ...] = ()
    # of the times between two commands from their median in [s]
    deviations: tuple[float, ...] = ()

    def __add__(self, other: CommandTiming) -> CommandTiming:
        """Return both together."""
        return CommandTiming(self.latencies + other.latencies, self.deviations + other.deviations)

    def latency(self, share: float) -> float:
        """Return a percentile of the latencies, 0.5 for the median, in [s]."""
        return _percentile(sorted(self.latencies), share)

    def jitter(self, share: float) -> float:
        """Return a percentile of the deviations in [s]."""
        return _percentile(sorted(self.deviations), share)


class CommandTimes:
    """Collects them; times are those of the robot [s]."""

    def __init__(self) -> None:
        """Begin without any."""
        self.clear()

    def clear(self) -> None:
        """Forget all."""
        self._state_at: float | None = None
        self._command_at: float | None = None
        self._latencies: deque[float] = deque(maxlen=WINDOW)
        self._intervals: deque[float] = deque(maxlen=WINDOW)

    def sent(self, now: float) -> None:
        """Note that bytes have arrived at the host."""
        self._state_at = now

    def commanded(self, begin: float) -> None:
        """Note the first byte of a command."""
        # a second command after a state is no answer to it, nor is one that was there before it
        if self._state_at is not None and begin > self._state_at:
            self._latencies.append(begin - self._state_at)
            self._state_at = None
        if self._command_at is not None:
            self._intervals.append(begin - self._command_at)
        self._command_at = begin

    def timing(self) -> CommandTiming:
        """Return what came together."""
        middle = _percentile(sorted(self._intervals), 0.5)
        return CommandTiming(
            tuple(self._latencies), tuple(abs(each - middle) for each in self._intervals)
        )


def _percentile(ordered: list[float], share: float) -> float:
    return ordered[int((len(ordered) - 1) * share)] if ordered else math.nan
