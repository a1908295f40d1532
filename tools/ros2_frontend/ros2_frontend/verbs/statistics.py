# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Rates, delays and bandwidths over a window of messages; pure, times are handed in."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
from dataclasses import dataclass
import math

NANOSECONDS = 1_000_000_000  # in a second
_KILO = 1000


@dataclass(frozen=True, slots=True)
class Spread:
    """Mean, extremes and standard deviation of some numbers.

    Attributes:
        mean: Arithmetic mean.
        low: Least.
        high: Greatest.
        deviation: Standard deviation of the population.
        count: How many numbers.
    """

    mean: float
    low: float
    high: float
    deviation: float
    count: int

    @classmethod
    def of(cls, values: Collection[float]) -> Spread:
        """Describe some numbers.

        Args:
            values: At least one.

        Returns:
            Their spread.
        """
        mean = sum(values) / len(values)
        variance = sum((value - mean) ** 2 for value in values) / len(values)
        return cls(mean, min(values), max(values), math.sqrt(variance), len(values))

    def line(self) -> str:
        """The second line of `topic hz` and `topic delay`; the values are in [ns]."""
        low, high, deviation = (
            value / NANOSECONDS for value in (self.low, self.high, self.deviation)
        )
        return f'\tmin: {low:.3f}s max: {high:.3f}s std dev: {deviation:.5f}s window: {self.count}'


class Periods:
    """The times between messages."""

    def __init__(self, window: int) -> None:
        """Start without a message.

        Args:
            window: How many periods to look at.
        """
        self._periods: deque[int] = deque(maxlen=window)
        self._last: int | None = None
        self._reported: int | None = None

    def add(self, now: int) -> bool:
        """Note that a message came.

        Args:
            now: When [ns].

        Returns:
            False when time went back, so that counting starts anew.
        """
        went_back = self._last is not None and now < self._last
        if went_back:
            self._periods.clear()
            self._reported = None
        elif self._last is not None:
            self._periods.append(now - self._last)
        self._last = now
        return not went_back

    def report(self) -> str | None:
        """What `topic hz` prints, at most once a second of message time.

        Returns:
            Two lines, or None when it is not yet time or there is nothing new.
        """
        if not self._periods or self._last is None:
            return None
        if self._reported is None:
            self._reported = self._last
            return None
        if self._last < self._reported + NANOSECONDS:
            return None
        self._reported = self._last
        spread = Spread.of(self._periods)
        rate = NANOSECONDS / spread.mean if spread.mean > 0.0 else 0.0
        return f'average rate: {rate:.3f}\n{spread.line()}'


class Delays:
    """The times from a message's stamp to its arrival."""

    def __init__(self, window: int) -> None:
        """Start without a message.

        Args:
            window: How many delays to look at.
        """
        self._delays: deque[int] = deque(maxlen=window)
        self._is_news = False

    def add(self, delay: int) -> None:
        """Note the delay of a message.

        Args:
            delay: Arrival minus stamp [ns].
        """
        self._delays.append(delay)
        self._is_news = True

    def report(self) -> str | None:
        """What `topic delay` prints each second.

        Returns:
            Two lines, `no new messages`, or None before the first message.
        """
        if not self._delays:
            return None
        if not self._is_news:
            return 'no new messages'
        self._is_news = False
        spread = Spread.of(self._delays)
        return f'average delay: {spread.mean / NANOSECONDS:.3f}\n{spread.line()}'


class Sizes:
    """The sizes of messages and when they came."""

    def __init__(self, window: int) -> None:
        """Start without a message.

        Args:
            window: How many messages to look at.
        """
        self._samples: deque[tuple[float, int]] = deque(maxlen=window)

    def add(self, now: float, size: int) -> None:
        """Note a message.

        Args:
            now: When [s].
            size: Its serialized size [byte].
        """
        self._samples.append((now, size))

    def report(self, now: float) -> str | None:
        """What `topic bw` prints each second.

        Args:
            now: The time [s].

        Returns:
            Two lines, or None before the second message.
        """
        if len(self._samples) < 2 or now <= self._samples[0][0]:
            return None
        spread = Spread.of([size for _, size in self._samples])
        rate = spread.mean * spread.count / (now - self._samples[0][0])
        texts = [_bytes(value, rate) for value in (rate, spread.mean, spread.low, spread.high)]
        return (
            f'{texts[0]}/s from {spread.count} messages\n'
            f'\tMessage size mean: {texts[1]} min: {texts[2]} max: {texts[3]}'
        )


def _bytes(value: float, scale: float) -> str:
    """A size in the unit that fits `scale`, so that one report has one unit."""
    if scale < _KILO:
        return f'{value:.0f} B'
    if scale < _KILO**2:
        return f'{value / _KILO:.2f} KB'
    return f'{value / _KILO**2:.2f} MB'
