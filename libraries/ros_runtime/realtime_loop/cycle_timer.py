# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Absolute deadlines on a grid; times are those of a steady clock in [s]."""

from __future__ import annotations

from typing import NamedTuple


class Cycle(NamedTuple):
    """A cycle that begins."""

    time: float  # its time on the grid
    late: float  # how long after its deadline it begins
    skipped: int  # deadlines that had passed as a whole before; their cycles are left out


class CycleTimer:
    """When the next cycle is due; after a stall cycles are skipped, and never made up for.

    So each cycle has a place of its own on the grid, and what is commanded in a cycle lasts for a
    period: a motion is late after a stall, but not faster.

    Attributes:
        period: Time between two cycles.
        deadline: When the next one is due.
    """

    def __init__(self, period: float, now: float) -> None:
        """Make the first cycle due now.

        Raises:
            ValueError: The period is not positive.
        """
        if not period > 0.0:
            raise ValueError(f'period is {period}; it must be positive')
        self.period = period
        self.deadline = now

    def begin(self, now: float) -> Cycle:
        """Begin the cycle that is due; the next deadline is the first on the grid after now."""
        late = max(0.0, now - self.deadline)
        skipped = int(late / self.period)
        time = self.deadline + skipped * self.period
        self.deadline = time + self.period
        return Cycle(time, late, skipped)
