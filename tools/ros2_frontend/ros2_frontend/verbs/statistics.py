# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Rates, delays and bandwidths over a window of messages; pure, times are handed in."""

from __future__ import annotations

from collections import deque
from collections.abc import Collection
import math

NANOSECONDS = 1_000_000_000  # in a second
_KILO = 1000


def spread(values: Collection[int]) -> str:
    """Return the second line of `topic hz` and `topic delay`, of values in [ns]."""
    count, least, most = len(values), min(values) / NANOSECONDS, max(values) / NANOSECONDS
    mean = sum(values) / count
    deviation = math.sqrt(sum((value - mean) ** 2 for value in values) / count) / NANOSECONDS
    return f'\tmin: {least:.3f}s max: {most:.3f}s std dev: {deviation:.5f}s window: {count}'


class Periods:
    """The times between the last messages, at most `window` of them."""

    def __init__(self, window: int) -> None:
        self._periods: deque[int] = deque(maxlen=window)
        self._last: int | None = None
        self._reported: int | None = None

    def add(self, now: int) -> str | None:
        """Note a message at a time in [ns]; return what to print, once a second of that time."""
        last, self._last = self._last, now
        if last is None:
            return None
        if now < last:
            self._periods.clear()
            self._reported = None
            return 'time has reset, resetting counters'
        self._periods.append(now - last)
        if self._reported is None:
            self._reported = now
        if now < self._reported + NANOSECONDS:
            return None
        self._reported = now
        total = sum(self._periods)
        rate = NANOSECONDS * len(self._periods) / total if total else 0.0
        return f'average rate: {rate:.3f}\n{spread(self._periods)}'


def delay_text(delays: deque[int], news: list[int]) -> str | None:
    """Move new delays in [ns] to the others; return what `topic delay` prints, None before any."""
    if not news:
        return 'no new messages' if delays else None
    delays.extend(news)
    news.clear()
    mean = sum(delays) / len(delays) / NANOSECONDS
    return f'average delay: {mean:.3f}\n{spread(delays)}'


def bandwidth(samples: Collection[tuple[float, int]], now: float) -> str | None:
    """Return what `topic bw` prints of times in [s] and sizes in [byte]; None before two."""
    if len(samples) < 2:
        return None
    times, sizes = zip(*samples, strict=True)
    if now <= times[0]:
        return None
    rate = sum(sizes) / (now - times[0])
    unit, scale = 'MB', _KILO**2
    if rate < _KILO**2:
        unit, scale = ('B', 1) if rate < _KILO else ('KB', _KILO)
    digits = 0 if scale == 1 else 2
    texts = [
        f'{value / scale:.{digits}f} {unit}'
        for value in (rate, sum(sizes) / len(sizes), min(sizes), max(sizes))
    ]
    return (
        f'{texts[0]}/s from {len(sizes)} messages\n'
        f'\tMessage size mean: {texts[1]} min: {texts[2]} max: {texts[3]}'
    )
