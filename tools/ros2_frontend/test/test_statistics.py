# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Rates, delays and bandwidths of made-up arrivals."""

from __future__ import annotations

from collections import deque

import pytest

from ros2_frontend.verbs.topic_rate import bandwidth, delay_text, NANOSECONDS, Periods

START = 1_700_000_000 * NANOSECONDS


def reports(window: int, arrivals: list[int]) -> list[str]:
    """Feed arrivals [ns] and collect what is reported."""
    periods = Periods(window)
    return [text for now in arrivals if (text := periods.add(now))]


def test_a_steady_rate_is_reported_once_a_second() -> None:
    """50 Hz for 3 s: reports at the second messages of seconds, of ever more periods."""
    arrivals = [START + index * NANOSECONDS // 50 for index in range(151)]
    first, second = reports(10_000, arrivals)
    assert first == 'average rate: 50.000\n\tmin: 0.020s max: 0.020s std dev: 0.00000s window: 51'
    assert second.endswith('window: 101')


def test_window_forgets_old_periods() -> None:
    """After a pause, a small window soon shows the new rate only."""
    slow = [START + index * NANOSECONDS for index in range(3)]
    fast = [slow[-1] + index * NANOSECONDS // 10 for index in range(1, 31)]
    assert reports(5, slow + fast)[-1].startswith('average rate: 10.000')


def test_time_that_goes_back_starts_anew() -> None:
    """A simulation that was reset does not give negative periods."""
    arrivals = [START, START + 1, START - 9, *(START + index * NANOSECONDS for index in range(3))]
    reset, report, *_ = reports(10, arrivals)
    assert reset == 'time has reset, resetting counters'
    assert report.endswith('window: 2')


def test_delay_reports_only_news() -> None:
    """Nothing before the first message; then the mean; then that there is nothing new."""
    delays, news = deque[int](maxlen=10), list[int]()
    assert delay_text(delays, news) is None
    news += [1_000_000, 3_000_000]
    line = '\tmin: 0.001s max: 0.003s std dev: 0.00100s window: 2'
    assert delay_text(delays, news) == f'average delay: 0.002\n{line}'
    assert delay_text(delays, news) == 'no new messages'


@pytest.mark.parametrize(
    ('size', 'rate', 'text'),
    [(10, '40 B/s', '10 B'), (1000, '4.00 KB/s', '1.00 KB'), (10**6, '4.00 MB/s', '1.00 MB')],
)
def test_bandwidth_has_one_unit(size: int, rate: str, text: str) -> None:
    """The unit of the rate is that of the sizes, too."""
    samples = [(now, size) for now in (0.0, 0.25, 0.5, 0.75)]
    assert bandwidth(samples[:1], 1.0) is None
    head = f'{rate} from 4 messages'
    assert (
        bandwidth(samples, 1.0) == f'{head}\n\tMessage size mean: {text} min: {text} max: {text}'
    )
