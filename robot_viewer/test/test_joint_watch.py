# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joints that are missing are told once, by name."""

from __future__ import annotations

import pytest
from urdf_reader import read_urdf
from urdf_robots import ARM, POSITIONS

from robot_viewer import JointWatch
from robot_viewer.joint_watch import PATIENCE

SOON, LATE, LATER = 0.5 * PATIENCE, 1.1 * PATIENCE, 5 * PATIENCE
TOPIC = '/dog/joint_states'


@pytest.fixture
def watch() -> JointWatch:
    """Watch the test arm from time 0 on."""
    return JointWatch(read_urdf(ARM), 0.0)


def test_a_complete_robot_is_no_reason_to_speak(watch: JointWatch) -> None:
    """A joint that follows another need not be in the message."""
    watch.take(POSITIONS)
    assert watch.warnings(LATE, TOPIC) == []


def test_joints_that_are_never_heard_of_are_told_once_and_not_too_early(watch: JointWatch) -> None:
    """By name; messages may be partial, so they are put together."""
    watch.take(['shoulder'])
    watch.take(['roll', 'finger_joint'])
    assert watch.warnings(SOON, TOPIC) == []
    (text,) = watch.warnings(LATE, TOPIC)
    assert 'lift' in text
    assert 'shoulder' not in text
    assert watch.warnings(LATER, TOPIC) == []


def test_names_that_the_description_does_not_know_are_told(watch: JointWatch) -> None:
    """The usual case: all of them are spelt otherwise."""
    watch.take(['Shoulder', *list(POSITIONS)[1:]])
    silent, strangers = watch.warnings(LATE, TOPIC)
    assert 'never heard on /dog/joint_states: shoulder;' in silent
    assert strangers.endswith(': Shoulder')


def test_silence_is_told_with_what_to_look_at(watch: JointWatch) -> None:
    """Nobody publishes, or in another domain."""
    (text,) = watch.warnings(LATE, TOPIC)
    assert f'ros2 topic info {TOPIC}' in text
    assert watch.warnings(LATER, TOPIC) == []


def test_a_robot_without_moving_joints_needs_no_messages() -> None:
    """Silence is right."""
    watch = JointWatch(read_urdf('<robot name="box"><link name="box"/></robot>'), 0.0)
    assert watch.warnings(LATE, TOPIC) == []
