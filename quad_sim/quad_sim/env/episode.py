# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How far an episode is, and what it has been worth so far."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import math
from typing import Any

from ..exceptions import SetupError


class Episode:
    """Counts the steps of an episode and adds up the terms of its rewards.

    Attributes:
        steps: How many there were.
    """

    def __init__(self, period: float, duration: float, terms: Sequence[str]) -> None:
        """Prepare it.

        Args:
            period: Of a step in [s].
            duration: Longest time of an episode in [s].
            terms: Names of the reward's terms.

        Raises:
            SetupError: A time is not above 0, or an episode is shorter than a step.
        """
        if not (0.0 < period < math.inf and period <= duration < math.inf):
            raise SetupError(
                f'period {period} s, duration {duration} s: give 0 < period < duration'
            )
        self._period, self._duration, self._terms = period, duration, tuple(terms)
        self.begin()

    def begin(self, duration: float | None = None) -> None:
        """Begin anew.

        Args:
            duration: Of this episode in [s]; the longest for None.
        """
        self.steps = 0
        self._most = round((self._duration if duration is None else duration) / self._period)
        self._sums = dict.fromkeys(self._terms, 0.0)

    def add(self, terms: Mapping[str, float]) -> float:
        """Count a step; return its reward.

        Args:
            terms: What each term was worth in it.
        """
        self.steps += 1
        for name, value in terms.items():
            self._sums[name] += value
        return sum(terms.values())

    @property
    def is_over(self) -> bool:
        """Whether its time has passed."""
        return self.steps >= self._most

    @property
    def info(self) -> dict[str, Any]:
        """What an environment returns at its end."""
        return {'reward_terms': dict(self._sums)}
