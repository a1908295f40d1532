# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which transforms follow from which messages."""

from __future__ import annotations

import itertools
import math

from hypothesis import given
from hypothesis import strategies as st
import pytest
from urdf_reader import read_urdf
from urdf_robots import ARM, POSITIONS

from robot_viewer import MessageProblem, Settings, StatePublisher
from robot_viewer.state_publisher import Update

MS = 1_000_000
"""A millisecond in [ns]."""
START = 10**18


def publisher(**options: object) -> StatePublisher:
    """Make one of the test arm."""
    return StatePublisher(read_urdf(ARM), Settings(**options))  # type: ignore[arg-type]


def send(core: StatePublisher, stamp: int, **positions: float) -> Update:
    """Send a message that arrives when it was stamped."""
    positions = positions or POSITIONS
    return core.update(list(positions), list(positions.values()), stamp, stamp)


def children(update: Update) -> set[str]:
    """Names of the frames that were published."""
    return {each.child for each in update.transforms}


def test_fixed_and_planar_joints_are_static_and_floating_ones_are_left_out() -> None:
    """As in the public robot_state_publisher."""
    assert {each.child for each in publisher().fixed()} == {'camera', 'plate'}


def test_only_joints_of_the_message_are_published_with_its_stamp() -> None:
    """Partial messages and joints of other robots are fine."""
    update = send(publisher(), START, shoulder=0.1, of_another_robot=1.0)
    assert children(update) == {'upper'}
    assert update.stamp == START
    assert update.problems == ()


def test_a_joint_that_follows_is_published_with_its_source() -> None:
    """Position times multiplier plus offset; not without its source."""
    update = send(publisher(), START)
    thumb = next(each for each in update.transforms if each.child == 'thumb')
    assert thumb.transform.translation == pytest.approx((0.0, -2 * 0.1 + 0.5, 0.0))
    assert 'thumb' not in children(send(publisher(), START, shoulder=0.0))


def test_a_joint_that_follows_and_is_in_the_message_is_where_the_message_says() -> None:
    """It is published once."""
    update = send(publisher(), START, finger_joint=0.1, thumb_joint=0.7)
    found = [each.transform.translation for each in update.transforms if each.child == 'thumb']
    assert found == [(0.0, 0.7, 0.0)]


def test_a_prefix_is_put_in_front_of_both_frames_as_it_is() -> None:
    """Without a slash of its own."""
    core = publisher(frame_prefix='dog_')
    assert {(each.parent, each.child) for each in send(core, START, shoulder=0.0).transforms} == {
        ('dog_base', 'dog_upper')
    }
    assert core.fixed()[0].child == 'dog_camera'


def test_messages_that_come_too_often_are_passed_over() -> None:
    """50 Hz become 50 transforms in 3 s at 20 Hz: one in 60 ms, the first multiple above 50."""
    core = publisher(publish_frequency=20.0)
    stamps = [START + 20 * MS * index for index in range(150)]
    sent = [stamp for stamp in stamps if send(core, stamp).transforms]
    assert {after - before for before, after in itertools.pairwise(sent)} == {60 * MS}


@given(st.floats(0.5, 1000.0), st.lists(st.integers(1, 400 * MS), min_size=2, max_size=30))
def test_transforms_of_a_joint_are_never_closer_than_the_interval(
    frequency: float, gaps: list[int]
) -> None:
    """And no message is passed over that comes later than that."""
    core = publisher(publish_frequency=frequency)
    stamp, last = START, None
    for gap in gaps:
        stamp += gap
        if send(core, stamp, shoulder=0.0).transforms:
            assert last is None or stamp - last >= core.settings.interval
            last = stamp
        else:
            assert last is not None
            assert stamp - last < core.settings.interval


def test_the_joint_that_waited_longest_decides() -> None:
    """A message with one new joint is published whole."""
    core = publisher()
    send(core, START, shoulder=0.0)
    assert not send(core, START + MS, shoulder=0.0).transforms
    assert children(send(core, START + 2 * MS, shoulder=0.0, lift=0.0)) == {'upper', 'slider'}


@pytest.mark.parametrize(
    'options', [{'publish_frequency': 0.0}, {'ignore_timestamp': True}], ids=['0 Hz', 'ignored']
)
def test_every_message_is_published_where_that_is_wanted(options: dict[str, object]) -> None:
    """With equal stamps, too."""
    core = publisher(**options)
    assert all(send(core, START).transforms for _ in range(3))


def test_a_clock_that_jumps_back_begins_anew() -> None:
    """A bag that is played in a loop."""
    core = publisher()
    send(core, START)
    update = send(core, START // 2)
    assert update.transforms
    assert update.problems == (MessageProblem.BACKWARDS,)


def test_an_old_message_is_passed_over() -> None:
    """The clock goes on; only the stamp is old."""
    core = publisher()
    send(core, START)
    names = list(POSITIONS)
    late = core.update(names, list(POSITIONS.values()), START - 5 * MS, START + MS)
    assert late.transforms == ()
    assert late.problems == ()


def test_a_message_without_stamp_gets_the_time_of_its_arrival() -> None:
    """A transform of the year 1970 is of no use to anybody."""
    update = publisher().update(['shoulder'], [0.0], 0, START)
    assert update.stamp == START
    assert update.problems == (MessageProblem.NO_STAMP,)
    assert update.transforms


@pytest.mark.parametrize(
    ('positions', 'problem'),
    [
        ([], MessageProblem.NO_POSITION),
        ([0.0], MessageProblem.LENGTHS),
        ([0.0] * 3, MessageProblem.LENGTHS),
    ],
)
def test_a_message_with_the_wrong_lengths_is_ignored(
    positions: list[float], problem: MessageProblem
) -> None:
    """And said so; the next good one is published."""
    core = publisher()
    update = core.update(['shoulder', 'lift'], positions, START, START)
    assert update == Update(START, (), (problem,))
    assert send(core, START + MS).transforms


@pytest.mark.parametrize('value', [math.nan, math.inf])
def test_a_position_that_is_not_finite_is_left_out(value: float) -> None:
    """The others are published; NaN in /tf breaks whoever listens."""
    update = send(publisher(), START, shoulder=value, lift=0.1)
    assert children(update) == {'slider'}
    assert update.problems == (MessageProblem.NOT_FINITE,)


@pytest.mark.parametrize('frequency', [-1.0, 1000.1, math.nan])
def test_a_frequency_beyond_its_range_is_refused(frequency: float) -> None:
    """With the range."""
    with pytest.raises(ValueError, match='between 0 and 1000'):
        Settings(publish_frequency=frequency)
