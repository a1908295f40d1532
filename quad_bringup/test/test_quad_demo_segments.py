# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo does when, and how regular a loop was."""

from __future__ import annotations

import itertools
import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_bringup.demo.period_statistics import PeriodStatistics
from quad_bringup.demo.segments import (
    MIN_DURATION,
    one_round,
    segments,
    share_of,
    STANDSTILL,
    Velocity,
)
from quad_controller.gait.body import BodyPose
from quad_controller.gait.generator import GaitGenerator
from quad_controller.gait.parameters import GaitParameters
from quad_controller.gait.schedule import Gait
from quad_controller.gait.velocity import Velocity as GaitVelocity
from quad_description import quadruped, robot_urdf


@given(st.floats(MIN_DURATION, 1000.0))
def test_a_round_takes_its_time_and_ends_at_rest(duration: float) -> None:
    """It walks forward at 0.2 m/s, turns and strafes; every segment has time to be measured."""
    found = list(segments(duration))
    assert sum(each.duration for each in found) == pytest.approx(duration)
    assert found[0].velocity == Velocity(forward=0.2)
    assert [each.name for each in found] == ['walk', 'turn', 'strafe', 'stop']
    assert found[-1].velocity == STANDSTILL
    assert all(0 < each.settling < 0.5 * each.duration for each in found)


def test_without_an_end_there_is_round_after_round() -> None:
    """Until it is left."""
    names = [each.name for each in itertools.islice(segments(None), 9)]
    assert names[:4] == names[4:8]
    assert names[8] == 'walk'


@pytest.mark.parametrize('gait', list(Gait))
def test_no_gait_is_asked_for_more_than_it_can(gait: Gait) -> None:
    """The controller walks every velocity of a round as it is asked for."""
    robot, parameters = quadruped(robot_urdf()), GaitParameters()
    for segment in one_round(20.0, share_of(gait.value)):
        generator = GaitGenerator(robot, parameters)
        generator.choose(gait)
        wanted = segment.velocity
        generator.step(
            GaitVelocity(wanted.forward, wanted.left, wanted.turn), BodyPose(), None, 0.02
        )
        assert (generator.gait, generator.clamped) == (gait, False)
    walk = one_round(20.0, share_of(gait.value))[0].velocity
    assert walk.forward > 0.6 * parameters.top_speed(gait)


@pytest.mark.parametrize('duration', [0.0, -1.0, MIN_DURATION - 0.1, math.nan])
def test_too_short_a_round_is_refused(duration: float) -> None:
    """With what it needs."""
    with pytest.raises(ValueError, match='too short'):
        one_round(duration)


def test_a_regular_stream_has_its_rate_and_no_jitter() -> None:
    """50 messages a second."""
    periods = PeriodStatistics(0.02)
    for index in range(200):
        periods.take(5.0 + 0.02 * index)
    figures = periods.figures()
    assert figures.rate == pytest.approx(50.0)
    assert figures.jitter_p99 == pytest.approx(0.0, abs=1e-9)


def test_jitter_is_the_deviation_from_the_period() -> None:
    """A tenth of the messages is 5 ms late: that is in p99 and not in p50."""
    periods = PeriodStatistics(0.02)
    for index in range(400):
        periods.take(0.02 * index + (0.005 if index % 10 == 0 else 0.0))
    figures = periods.figures()
    assert figures.jitter_p50 == pytest.approx(0.0, abs=1e-9)
    assert figures.jitter_p99 == pytest.approx(0.005)
    assert figures.rate == pytest.approx(50.0, rel=0.01)


def test_one_message_has_no_rate() -> None:
    """Nor has none."""
    periods = PeriodStatistics(0.02)
    assert math.isnan(periods.figures().rate)
    periods.take(1.0)
    assert math.isnan(periods.figures().rate)
