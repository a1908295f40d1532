# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joints that are missing are reported once, by name."""

from __future__ import annotations

import pytest
from urdf_reader import read_urdf
from urdf_robots import ARM, POSITIONS

from robot_viewer import JointWatch
from robot_viewer.joint_watch import SILENCE_TIMEOUT, START_TIMEOUT

SOON, LATE, LATER = 0.5 * SILENCE_TIMEOUT, 1.1 * SILENCE_TIMEOUT, 5 * SILENCE_TIMEOUT
TOPIC = '/dog/joint_states'


@pytest.fixture
def watch() -> JointWatch:
    """Watch the test arm from time 0 on."""
    return JointWatch(read_urdf(ARM), 0.0)


def test_a_complete_robot_is_no_reason_to_speak(watch: JointWatch) -> None:
    """A joint that follows another need not be in the message."""
    watch.take(POSITIONS)
    assert watch.warnings(LATE, TOPIC, 1) == []


def test_joints_in_no_message_are_reported_once_and_not_too_early(
    watch: JointWatch,
) -> None:
    """By name; messages may be partial, so they are put together."""
    watch.take(['shoulder'])
    watch.take(['roll', 'finger_joint'])
    assert watch.warnings(SOON, TOPIC, 1) == []
    (text,) = watch.warnings(LATE, TOPIC, 1)
    assert 'lift' in text
    assert 'shoulder' not in text
    assert watch.warnings(LATER, TOPIC, 1) == []


def test_names_that_the_description_does_not_have_are_reported(watch: JointWatch) -> None:
    """The usual case: all of them are spelt otherwise."""
    watch.take(['Shoulder', *list(POSITIONS)[1:]])
    silent, unknown = watch.warnings(LATE, TOPIC, 1)
    assert 'no message on /dog/joint_states has shoulder:' in silent
    assert unknown.endswith(': Shoulder')


def test_a_silent_publisher_is_reported_with_what_to_look_at(watch: JointWatch) -> None:
    """Its time begins when it is there, however long that took."""
    assert watch.warnings(LATE, TOPIC, 1) == []
    assert watch.warnings(LATE + SOON, TOPIC, 1) == []
    (text,) = watch.warnings(LATE + LATE, TOPIC, 1)
    assert f'ros2 topic info {TOPIC}' in text
    assert watch.warnings(LATER, TOPIC, 1) == []


def test_a_start_that_takes_long_is_no_reason_to_warn(watch: JointWatch) -> None:
    """It is a note, once; and a warning when it is too long for a start."""
    assert watch.notes(SOON, TOPIC, 0) == []
    (note,) = watch.notes(LATE, TOPIC, 0)
    assert 'nobody publishes it: fine while the robot starts' in note
    assert watch.notes(LATE, TOPIC, 0) == watch.warnings(LATE, TOPIC, 0) == []
    too_long = START_TIMEOUT + 0.1
    assert watch.notes(too_long, TOPIC, 0) == []
    (text,) = watch.warnings(too_long, TOPIC, 0)
    assert f'ros2 topic info {TOPIC}' in text


def test_a_robot_without_moving_joints_needs_no_messages() -> None:
    """Silence is right."""
    watch = JointWatch(read_urdf('<robot name="box"><link name="box"/></robot>'), 0.0)
    assert watch.warnings(LATE, TOPIC, 1) == []
