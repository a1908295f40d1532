# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Rates, delays and bandwidths of made-up arrivals."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from ros2_frontend.verbs.statistics import Delays, NANOSECONDS, Periods, Sizes, Spread

START = 1_700_000_000 * NANOSECONDS


def reports(periods: Periods, arrivals: list[int]) -> list[str]:
    """Feed arrivals [ns] and collect what is reported."""
    found = []
    for now in arrivals:
        periods.add(now)
        found.append(periods.report())
    return [text for text in found if text]


def test_a_steady_rate_is_reported_once_a_second() -> None:
    """50 Hz for 3 s: reports at the second messages of seconds, of ever more periods."""
    arrivals = [START + index * NANOSECONDS // 50 for index in range(151)]
    first, second = reports(Periods(10_000), arrivals)
    assert first == 'average rate: 50.000\n\tmin: 0.020s max: 0.020s std dev: 0.00000s window: 51'
    assert second.endswith('window: 101')


def test_window_forgets_old_periods() -> None:
    """After a pause, a small window soon shows the new rate only."""
    slow = [START + index * NANOSECONDS for index in range(3)]
    fast = [slow[-1] + index * NANOSECONDS // 10 for index in range(1, 31)]
    assert reports(Periods(5), slow + fast)[-1].startswith('average rate: 10.000')


def test_time_that_goes_back_starts_anew() -> None:
    """A simulation that was reset does not give negative periods."""
    periods = Periods(10)
    assert all(periods.add(START + index) for index in range(5))
    assert not periods.add(START - 1)
    assert periods.report() is None


@given(st.lists(st.floats(-1e6, 1e6), min_size=1))
def test_spread_brackets_its_mean(values: list[float]) -> None:
    """Least <= mean <= greatest, and no deviation beyond their distance."""
    spread = Spread.of(values)
    slack = 1e-6
    assert spread.low - slack <= spread.mean <= spread.high + slack
    assert 0.0 <= spread.deviation <= spread.high - spread.low + slack
    assert spread.count == len(values)


def test_delay_reports_only_news() -> None:
    """Nothing before the first message; then the mean; then that there is nothing new."""
    delays = Delays(10)
    assert delays.report() is None
    delays.add(1_000_000)
    delays.add(3_000_000)
    line = '\tmin: 0.001s max: 0.003s std dev: 0.00100s window: 2'
    assert delays.report() == f'average delay: 0.002\n{line}'
    assert delays.report() == 'no new messages'


@pytest.mark.parametrize(
    ('size', 'rate', 'text'),
    [(10, '40 B/s', '10 B'), (1000, '4.00 KB/s', '1.00 KB'), (10**6, '4.00 MB/s', '1.00 MB')],
)
def test_bandwidth_has_one_unit(size: int, rate: str, text: str) -> None:
    """The unit of the rate is that of the sizes, too."""
    sizes = Sizes(100)
    assert sizes.report(1.0) is None
    for now in (0.0, 0.25, 0.5, 0.75):
        sizes.add(now, size)
    head = f'{rate} from 4 messages'
    assert sizes.report(1.0) == f'{head}\n\tMessage size mean: {text} min: {text} max: {text}'
