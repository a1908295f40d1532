# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages as bytes are the messages that ROS makes of them, both ways."""

from __future__ import annotations

from collections.abc import Sequence

from builtin_interfaces.msg import Time
from hypothesis import given
from hypothesis import strategies as st
import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import Imu, JointState, LaserScan
from std_msgs.msg import Header

from message_templates import FastReader, MessageTemplate, serialized, SerializedTemplate

pytestmark = pytest.mark.slow

NUMBERS = st.lists(st.floats(allow_nan=False), min_size=3, max_size=3)
STAMPS = st.builds(Time, sec=st.integers(0, 2**31 - 1), nanosec=st.integers(0, 10**9 - 1))
TEXTS = st.text('abc/_é', max_size=9)


def pair(frame: str, *, loses: bool = False) -> MessageTemplate:
    """Return a form of two numbers, of which it may lose the second."""

    def message(stamp: Time, numbers: Sequence[float]) -> JointState:
        kept = numbers[:1] if loses else [numbers[0], *numbers]
        return JointState(header=Header(stamp=stamp, frame_id=frame), position=kept)

    return MessageTemplate(message, 2)


@given(TEXTS, STAMPS, st.floats(allow_nan=False), st.floats(allow_nan=False))
def test_a_template_is_received_as_its_message(
    frame: str, stamp: Time, one: float, two: float
) -> None:
    """Whatever its numbers and stamp; a number may stand in several places."""
    data = SerializedTemplate(pair(frame)).fill(10**9 * stamp.sec + stamp.nanosec, (one, two))
    assert deserialize_message(data, JointState) == pair(frame).message(stamp, (one, two))


def scan(stamp: Time, numbers: Sequence[float]) -> LaserScan:
    """Return a message of short numbers."""
    return LaserScan(header=Header(stamp=stamp), range_max=numbers[0], ranges=numbers[1:])


SHORT = st.lists(st.floats(width=32, allow_nan=False), min_size=3, max_size=3)


@given(SHORT, SHORT, STAMPS)
def test_float32_goes_both_ways(one: list[float], two: list[float], stamp: Time) -> None:
    """Written by a template, and read."""
    reader = FastReader(LaserScan, 'range_max', 'ranges')
    template = SerializedTemplate(MessageTemplate(scan, 3))
    for numbers in (one, two):
        message, found = reader.read(template.fill(10**9 * stamp.sec + stamp.nanosec, numbers))
        assert list(found) == numbers
        assert len(message.ranges) == 2


def test_a_form_that_loses_a_number_is_refused() -> None:
    """Before anything is published; the message says which number."""
    with pytest.raises(ValueError, match='number 1 of 2'):
        SerializedTemplate(pair('', loses=True))


def joints(names: Sequence[str], numbers: Sequence[float], stamp: Time) -> JointState:
    """Joint states with positions and one velocity."""
    head = Header(stamp=stamp, frame_id='base')
    return JointState(header=head, name=names, position=numbers[:2], velocity=numbers[2:])


@given(
    st.lists(
        st.tuples(st.sampled_from([('a', 'b'), ('b', 'a'), ('a', 'long')]), NUMBERS, STAMPS),
        max_size=12,
    )
)
def test_a_reader_reads_what_was_written(
    messages: list[tuple[Sequence[str], list[float], Time]],
) -> None:
    """In any order of forms, learnt or not: names and numbers are those of the message."""
    reader = FastReader(JointState, 'position', 'velocity')
    for names, numbers, stamp in messages:
        message, found = reader.read(serialize_message(joints(names, numbers, stamp)))
        assert (list(message.name), list(found)) == (list(names), numbers)


@given(NUMBERS, NUMBERS, STAMPS)
def test_nested_numbers_are_read(one: list[float], two: list[float], stamp: Time) -> None:
    """Path by path, in the order in which the paths were given."""
    reader = FastReader(Imu, 'linear_acceleration.z', 'angular_velocity.x', 'orientation.w')
    for values in (one, two):
        message = Imu(header=Header(stamp=stamp, frame_id='imu'))
        message.linear_acceleration.z, message.angular_velocity.x = values[:2]
        message.orientation.w = values[2]
        read, found = reader.read(serialize_message(message))
        assert list(found) == values
        assert read.header.frame_id == 'imu'


def test_messages_of_one_form_are_read_in_full_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """That is what the reader is for; another form is read in full, and learnt."""
    full = []

    def deserialize(data: bytes, kind: type) -> object:
        full.append(data)
        return deserialize_message(data, kind)

    monkeypatch.setattr(serialized, 'deserialize_message', deserialize)
    reader = FastReader(JointState, 'position', 'velocity')
    for form in (('a', 'b'), ('c', 'd')):
        data = bytearray(serialize_message(joints(form, [1.0, 2.0, 3.0], Time(sec=1))))
        for second in range(5):
            data[4] = second  # of the stamp
            reader.read(bytes(data))
    assert len(full) == 2


def test_a_message_without_numbers_is_read() -> None:
    """Empty joint states are no reason to fail."""
    reader = FastReader(JointState, 'position', 'velocity')
    for _ in range(3):
        message, numbers = reader.read(serialize_message(JointState(name=['a'])))
        assert (message.name, list(numbers)) == (['a'], [])
