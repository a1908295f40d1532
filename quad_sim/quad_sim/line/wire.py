# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A serial line in time: bytes take as long as the baud rate says, and may be damaged on the way.

A pseudo-terminal moves everything at once; this is what makes it a wire.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
import math
import random

from .faults import FaultKind, FaultPlan

BITS_PER_BYTE = 10  # 8N1: start, eight data bits, stop


@dataclass(slots=True)
class LineCounters:
    """What went over one direction of a line."""

    bytes: int = 0  # bytes put in
    dropped: int = 0  # bytes that a fault swallowed
    flipped: int = 0  # bytes that a fault damaged


@dataclass(frozen=True, slots=True)
class Arrival:
    """Bytes at the end of a line."""

    end: float  # when the last of them is there [s]
    data: bytes  # what is left of them
    seconds_per_byte: float  # how long each took on the line [s]


class Wire:
    """One direction of a serial line."""

    def __init__(self, faults: FaultPlan, muted_by: FaultKind, seed: int, *, slow: bool) -> None:
        """Lay the wire.

        Args:
            muted_by: The fault in which nothing gets through.
        """
        self.counters = LineCounters()
        self._faults = faults
        self._muted_by = muted_by
        self._random = random.Random(seed)  # noqa: S311  for tests, not for secrets
        self._slow = slow
        self._free_at = -math.inf
        self._queue: deque[Arrival] = deque()

    def put(self, data: bytes, now: float, baud: int) -> None:
        """Put bytes on the wire; they follow those that are still on it."""
        seconds = BITS_PER_BYTE / baud
        end = max(now, self._free_at) + len(data) * seconds
        self._free_at = end
        self.counters.bytes += len(data)
        if self._faults.active(self._muted_by, now) is not None:
            return
        slow = self._faults.active(FaultKind.SLOW, now) if self._slow else None
        self._queue.append(
            Arrival(end + (slow['delay'] if slow else 0.0), self._damage(data, now), seconds)
        )

    def take(self, now: float) -> list[Arrival]:
        """Return what has arrived, in order."""
        arrived = []
        while self._queue and self._queue[0].end <= now:
            arrived.append(self._queue.popleft())
        return arrived

    def clear(self) -> None:
        """Forget what is on the way."""
        self._queue.clear()

    @property
    def next_arrival(self) -> float:
        """When the next bytes are there [s]; infinity for none."""
        return self._queue[0].end if self._queue else math.inf

    def _damage(self, data: bytes, now: float) -> bytes:
        flip = self._faults.active(FaultKind.FLIP, now)
        if flip is not None:
            data = bytes(map(self._flip, data, [flip['rate']] * len(data)))
        drop = self._faults.active(FaultKind.DROP, now)
        if drop is not None:
            whole = len(data)
            data = bytes(byte for byte in data if self._random.random() >= drop['rate'])
            self.counters.dropped += whole - len(data)
        return data

    def _flip(self, byte: int, rate: float) -> int:
        if self._random.random() >= rate:
            return byte
        self.counters.flipped += 1
        return byte ^ (1 << self._random.randrange(8))
