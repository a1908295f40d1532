# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from operator_input import CommandStream, RESTS

PERIOD = 0.05
COMMANDS = st.sampled_from([None, 0.1, 0.5, -0.2])
STEPS = st.lists(st.tuples(COMMANDS, st.sampled_from([0.0, 0.01, 0.03, 0.05, 0.2])), max_size=60)
Step = tuple[float | None, float]


def silence(stream: CommandStream[float], now: float) -> list[float]:
    """Want nothing for a long time, and return what is published."""
    published = (stream.step(None, now + 0.01 * index) for index in range(100))
    return [velocity for velocity in published if velocity is not None]


@given(STEPS)
def test_only_what_is_wanted_or_zero_is_published(steps: list[Step]) -> None:
    """No other velocity ever leaves, and a motion only while it is wanted."""
    stream, now = CommandStream(PERIOD, lambda _: 0.0), 0.0
    for wanted, gap in steps:
        now += gap
        published = stream.step(wanted, now)
        assert published in {wanted, None} if wanted is not None else published in {0.0, None}


@given(STEPS)
def test_every_motion_ends_with_zeros_and_then_silence(steps: list[Step]) -> None:
    """However it went before: after the end there are some zeros, and nothing more."""
    stream, now, moving = CommandStream(PERIOD, lambda _: 0.0), 0.0, False
    for wanted, gap in steps:
        now += gap
        stream.step(wanted, now)
        moving = wanted is not None
    published = silence(stream, now)
    assert set(published) <= {0.0}
    assert len(published) == RESTS if moving else len(published) <= RESTS
    assert stream.is_idle
    assert stream.due() == math.inf


@given(STEPS)
def test_change_is_published_at_once(steps: list[Step]) -> None:
    """A new velocity, and the first zero, do not wait for the next period."""
    stream, now, last = CommandStream(PERIOD, lambda _: 0.0), 0.0, None
    for wanted, gap in steps:
        now += gap
        published = stream.step(wanted, now)
        if wanted != last:
            assert published == (wanted or 0.0)
        last = wanted


def test_steady_velocity_is_repeated_at_the_rate() -> None:
    """A held key publishes once a period, however often it is looked at."""
    stream = CommandStream(PERIOD, lambda _: 0.0)
    times = [0.001 * index for index in range(1000)]
    published = [stream.step(0.1, now) for now in times]
    assert sum(velocity is not None for velocity in published) == pytest.approx(20, abs=1)


def test_idle_source_is_silent() -> None:
    """Nothing is published before anything is wanted, nor at the end of an idle program."""
    stream = CommandStream(PERIOD, lambda _: 0.0)
    assert silence(stream, 0.0) == []
    stream.end()
    assert silence(stream, 10.0) == []


def test_stop_speaks_even_when_idle() -> None:
    """Another program may be driving: a person's stop is published."""
    stream = CommandStream(PERIOD, lambda _: 0.0)
    stream.stop()
    assert silence(stream, 0.0) == [0.0] * RESTS


def test_end_says_zero_again_after_a_motion() -> None:
    """A program that moved the robot says zero when it ends, even if it said so before."""
    stream = CommandStream(PERIOD, lambda _: 0.0)
    stream.step(0.1, 0.0)
    silence(stream, 0.1)
    stream.end()
    assert silence(stream, 10.0) == [0.0] * RESTS


@pytest.mark.parametrize('period', [0.0, -1.0, math.inf, math.nan])
def test_senseless_period_is_refused(period: float) -> None:
    """A period must be a time."""
    with pytest.raises(ValueError, match='period'):
        CommandStream(period, lambda _: 0.0)
