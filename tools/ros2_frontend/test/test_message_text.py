# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages to documents and CSV, with everything that can be left out."""

from __future__ import annotations

from geometry_msgs.msg import Point, Point32, Polygon, PoseWithCovariance, Twist
import pytest
from rcl_interfaces.msg import ParameterValue
from sensor_msgs.msg import JointState
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Byte, ByteMultiArray, Char, Empty, String

from ros2_frontend.messages.document import Abbreviation, to_csv, to_document, to_yaml

TWIST = """\
linear:
  x: 1.0
  y: 0.0
  z: 0.0
angular:
  x: 0.0
  y: 0.0
  z: 0.5
"""
JOINTS = """\
header:
  stamp:
    sec: 0
    nanosec: 0
  frame_id: base
name:
- one
- two
position:
- 0.5
- -1.0
velocity: []
effort: []
"""


def joints() -> JointState:
    """Make a message with texts and arrays."""
    message = JointState(name=['one', 'two'], position=[0.5, -1.0])
    message.header.frame_id = 'base'
    return message


def test_nested_messages_are_indented() -> None:
    """Fields in the order of their definition, two spaces a level."""
    message = Twist()
    message.linear.x, message.angular.z = 1.0, 0.5
    assert to_yaml(to_document(message)) == TWIST


def test_arrays_are_blocks_below_their_field() -> None:
    """An array's dashes stand under the field's name; an empty one is `[]`."""
    assert to_yaml(to_document(joints())) == JOINTS


def test_fixed_arrays_are_plain_numbers() -> None:
    """A numpy array gives Python floats."""
    document = to_document(PoseWithCovariance())
    assert document['covariance'] == [0.0] * 36
    assert {type(value) for value in document['covariance']} == {float}


def test_arrays_of_messages_are_lists_of_documents() -> None:
    """An array of points."""
    polygon = Polygon(points=[Point32(x=1.0)])
    assert to_yaml(to_document(polygon)) == 'points:\n- x: 1.0\n  y: 0.0\n  z: 0.0\n'


def test_bytes_are_texts_of_the_same_code_points() -> None:
    """A byte 0x41 is shown as A, as rosidl_runtime_py does."""
    assert to_document(Byte(data=b'A')) == {'data': 'A'}
    assert to_document(ByteMultiArray(data=[b'\x00', b'\xff']))['data'] == ['\x00', '\xff']


def test_a_message_without_fields() -> None:
    """An empty message is an empty mapping."""
    assert to_yaml(to_document(Empty())) == '{}\n'
    assert to_csv(Empty()) == ''


@pytest.mark.parametrize(
    ('length', 'expected'),
    [(None, 'Hello World'), (11, 'Hello World'), (5, 'Hello...'), (0, '...')],
)
def test_long_texts_end_in_dots(length: int | None, expected: str) -> None:
    """A text is cut after so many characters."""
    assert to_document(String(data='Hello World'), Abbreviation(length)) == {'data': expected}


def test_long_arrays_end_in_dots() -> None:
    """An array is cut after so many elements, its elements too."""
    document = to_document(joints(), Abbreviation(1))
    assert document['name'] == ['o...', '...']
    assert document['position'] == [0.5, '...']


def test_arrays_and_texts_can_be_left_out() -> None:
    """Their stand-ins name type and length."""
    cut = Abbreviation(no_arrays=True, no_texts=True)
    document = to_document(joints(), cut)
    assert document['header']['frame_id'] == '<string length: <4>>'
    assert document['name'] == '<sequence type: string, length: 2>'
    assert document['position'] == '<sequence type: double, length: 2>'
    assert to_document(PoseWithCovariance(), cut)['covariance'] == '<array type: double[36]>'
    points = to_document(Polygon(), cut)['points']
    assert points == '<sequence type: geometry_msgs/msg/Point32, length: 0>'
    bounded = to_document(SolidPrimitive(), cut)['dimensions']
    assert bounded == '<sequence type: double[3], length: 0>'


def test_csv_is_one_line_depth_first() -> None:
    """All values of all levels in order."""
    assert to_csv(joints()) == '0,0,base,one,two,0.5,-1.0,,'
    assert to_csv(Point(x=1.0)) == '1.0,0.0,0.0'
    assert to_csv(Char(data=65)) == '65'
    assert to_csv(Byte(data=b'A')) == "b'A'"


def test_csv_abbreviates_like_yaml() -> None:
    """The same options have the same effect."""
    assert to_csv(joints(), Abbreviation(1)) == '0,0,b...,o...,...,0.5,...,,'
    cut = Abbreviation(no_arrays=True, no_texts=True)
    assert to_csv(String(data='abc'), cut) == '<string length: <3>>'
    assert '<sequence type: double, length: 2>' in to_csv(joints(), cut)


def test_bool_arrays_stay_bools() -> None:
    """No kind of array loses its element type."""
    value = ParameterValue(bool_array_value=[True, False], integer_array_value=[1])
    document = to_document(value)
    assert document['bool_array_value'] == [True, False]
    assert document['integer_array_value'] == [1]
