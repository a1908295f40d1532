# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Figures of the cycle against the definition of a percentile."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from arm_canopen.master.runner import CycleStatistics

LATE = st.lists(st.floats(-0.001, 0.1), min_size=1, max_size=60)


@given(LATE, st.integers(1, 50))
def test_percentiles_are_those_of_the_window(late: list[float], window: int) -> None:
    """At least half (99 %) of the last cycles were not later than p50 (p99), and p99 occurred."""
    statistics = CycleStatistics(0.01, window)
    for value in late:
        statistics.record(value, 0)
    figures = statistics.figures()
    last = late[-window:]
    assert figures.jitter_max == max(last)
    assert figures.jitter_p50 <= figures.jitter_p99 <= figures.jitter_max
    for percentile, share in ((figures.jitter_p50, 0.5), (figures.jitter_p99, 0.99)):
        assert percentile in last
        below = sum(value <= percentile for value in last)
        above = sum(value >= percentile for value in last)
        assert below >= share * len(last) - 1
        assert above >= (1.0 - share) * len(last) - 1


@given(st.lists(st.integers(0, 5), max_size=100))
def test_cycles_and_overruns_count_from_the_start(skipped: list[int]) -> None:
    """Counts do not forget what the window has forgotten."""
    statistics = CycleStatistics(0.01, 10)
    for count in skipped:
        statistics.record(0.0, count)
    figures = statistics.figures()
    assert (figures.cycles, figures.overruns) == (len(skipped), sum(skipped))
    assert figures.period == 0.01


def test_no_cycle_has_no_jitter() -> None:
    """Before the first cycle all figures are 0."""
    figures = CycleStatistics(0.01).figures()
    assert (figures.cycles, figures.jitter_p50, figures.jitter_p99, figures.jitter_max) == (0,) * 4
