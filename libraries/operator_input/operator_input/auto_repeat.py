# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How long a key whose release is not reported counts as held.

A keyboard repeats a held key: once after a delay (250 ms to 660 ms, the user's setting), then
every 20 ms to 50 ms. A terminal passes on the characters alone. So a key counts as held until its
next character is overdue: first by the delay, later by the interval. The delay is learned from
the first key that is held long enough; until then it is a guess.
"""

from __future__ import annotations

from collections import deque

FASTEST_DELAY, SLOWEST_DELAY = 0.18, 0.7  # [s] settings of desktops, with a margin
SLOWEST_INTERVAL = 0.1  # [s] between two repeats; what is slower may be a finger
MARGIN = 1.2  # a repeat may come later by this factor


class AutoRepeat:
    """Time-outs of the two stages, and what was learned of the keyboard's delay.

    Attributes:
        repeat: Longest time between two repeats of a held key [s].
    """

    def __init__(self, first: float = 0.5, repeat: float = 0.15) -> None:
        """Start with guesses.

        Args:
            first: Time-out after the first character of a key [s], until it is learned.
            repeat: Time-out after each further one [s].

        Raises:
            ValueError: A time-out is not positive, or the second one is the longer one.
        """
        if not 0 < repeat <= first:
            raise ValueError(f'time-outs {first} s and {repeat} s: wanted 0 < repeat <= first')
        self.repeat = repeat
        self._guess = first
        self._delay: float | None = None
        self._gaps: deque[float] = deque(maxlen=3)

    @property
    def first(self) -> float:
        """Time-out after the first character of a key [s]."""
        if self._delay is None:
            return self._guess
        return max(self._delay * MARGIN, self.repeat)

    @property
    def longest(self) -> float:
        """Bound of every time-out that this object will ever give [s]."""
        return max(self._guess, SLOWEST_DELAY * MARGIN, self.repeat)

    def is_new_stroke(self, gap: float) -> bool:
        """Return whether the same character came from a finger, not from the keyboard's repeat.

        Only a learned delay can decide: what comes much before it is no repeat.

        Args:
            gap: Time since the first character of the key [s].
        """
        return self._delay is not None and self.repeat < gap < self._delay / MARGIN

    def learn(self, gap: float | None) -> None:
        """Take notice of a character.

        Args:
            gap: Time since the one before, if that was the same [s]; None for another key.
        """
        if gap is None:
            self._gaps.clear()
            return
        self._gaps.append(gap)
        if len(self._gaps) == self._gaps.maxlen:
            delay, *repeats = self._gaps
            if FASTEST_DELAY < delay < SLOWEST_DELAY and max(repeats) < SLOWEST_INTERVAL:
                self._delay = delay
