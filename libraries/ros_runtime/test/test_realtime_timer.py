# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Deadlines in virtual time: on the grid, and never two cycles where there is time for one."""

from __future__ import annotations

from itertools import combinations, pairwise

from hypothesis import given
from hypothesis import strategies as st
import pytest

from realtime_loop import Cycle, CycleTimer

PERIODS = st.floats(1e-4, 1.0)
STALLS = st.lists(st.floats(0.0, 20.0), min_size=1, max_size=30)


def run(period: float, stalls: list[float]) -> tuple[list[float], list[Cycle]]:
    """Run cycles that take so many periods each; return when each began, and the cycles."""
    timer, now = CycleTimer(period, 100.0), 100.0
    begins, cycles = [], []
    for stall in stalls:
        now = max(now, timer.deadline)
        begins.append(now)
        cycles.append(timer.begin(now))
        now += stall * period
    return begins, cycles


@given(PERIODS, STALLS)
def test_a_stall_is_never_made_up_for_by_a_burst(period: float, stalls: list[float]) -> None:
    """Of cycles in a row only the first may be late, so that n of them take n - 2 periods."""
    begins, cycles = run(period, stalls)
    for (i, first), (j, last) in combinations(enumerate(begins), 2):
        assert last - first >= (j - i - 1) * period * (1.0 - 1e-6)
    times = [cycle.time for cycle in cycles]
    assert all(b - a > 0.999 * period for a, b in pairwise(times))


@given(PERIODS, STALLS)
def test_every_place_of_the_grid_is_a_cycle_or_skipped(period: float, stalls: list[float]) -> None:
    """A cycle is of the last place that has passed; the grid does not drift, nothing is lost."""
    skipped = 0
    for number, (begin, cycle) in enumerate(zip(*run(period, stalls), strict=True)):
        skipped += cycle.skipped
        assert cycle.time == pytest.approx(100.0 + (number + skipped) * period, rel=1e-9)
        assert -1e-9 <= begin - cycle.time <= period * 1.001


@pytest.mark.parametrize('period', [0.0, -0.01, float('nan')])
def test_a_period_is_positive(period: float) -> None:
    """Anything else would be a burst without end."""
    with pytest.raises(ValueError, match='positive'):
        CycleTimer(period, 0.0)
