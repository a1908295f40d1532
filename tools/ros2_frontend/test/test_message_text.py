# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Messages to documents and CSV, with everything that can be left out."""

from __future__ import annotations

import sys
from typing import Any

from geometry_msgs.msg import Point, Point32, Polygon, PoseWithCovariance, Vector3
from hypothesis import example, given
from hypothesis import strategies as st
import pytest
from rcl_interfaces.msg import ParameterValue
from sensor_msgs.msg import JointState
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Byte, ByteMultiArray, Char, Empty, String
import yaml

from ros2_frontend.messages.fill import Abbreviation, to_csv, to_document, to_yaml
from ros2_frontend.names import Message

FIELDS = st.from_regex(r'[a-z][a-z0-9_]{0,5}', fullmatch=True) | st.sampled_from(['y', 'on', 'no'])
TEXTS = st.text(max_size=12) | st.sampled_from(
    ['', ' ', 'No', '1', '1e3', '1:30', '~', '- a', '/tf']
)
SCALARS = st.one_of(TEXTS, st.booleans(), st.integers(-(2**63), 2**64 - 1), st.floats())
DOCUMENTS = st.dictionaries(
    FIELDS,
    st.recursive(
        SCALARS,
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(FIELDS, inner, max_size=3),
        max_leaves=8,
    ),
    max_size=4,
)


@pytest.mark.slow
@given(DOCUMENTS, st.booleans())
@example({'a': [[[], {}], [{'b': [1.0]}]]}, False)
@example({'a': {'b': '\x85'}}, False)
@example({'on': 1e22, 'b': -1e-07, 'c': float('-inf')}, False)
def test_yaml_is_that_of_rosidl_runtime_py(document: dict[str, Any], flow_style: bool) -> None:
    """PyYAML with its settings, whatever dumper is used here."""
    text: str = yaml.dump(
        document,
        Dumper=yaml.SafeDumper,
        allow_unicode=True,
        width=sys.maxsize,
        default_flow_style=flow_style,
        sort_keys=False,
    )
    assert to_yaml(document, flow_style) == text


def joints() -> JointState:
    """Make a message with texts and arrays."""
    message = JointState(name=['one', 'two'], position=[0.5, -1.0])
    message.header.frame_id = 'base'
    return message


@pytest.mark.parametrize(
    ('message', 'text'),
    [
        (Vector3(z=0.5), 'x: 0.0\ny: 0.0\nz: 0.5\n'),
        (Polygon(points=[Point32(x=1.0)]), 'points:\n- x: 1.0\n  y: 0.0\n  z: 0.0\n'),
        (Byte(data=b'A'), 'data: A\n'),  # the text of the same code point, as rosidl_runtime_py
        (
            ByteMultiArray(data=[b'a', b'\xff']),
            'layout:\n  dim: []\n  data_offset: 0\ndata:\n- a\n- ÿ\n',
        ),
        (Empty(), '{}\n'),
    ],
)
def test_a_message_as_yaml(message: Message, text: str) -> None:
    """Fields in the order of their definition, two spaces a level, dashes below their field."""
    assert to_yaml(to_document(message)) == text


def test_numbers_of_arrays_are_those_of_python() -> None:
    """No kind of array loses its element type, and numpy's is left behind."""
    document = to_document(PoseWithCovariance())
    assert document['covariance'] == [0.0] * 36
    assert {type(value) for value in document['covariance']} == {float}
    value = to_document(ParameterValue(bool_array_value=[True, False], integer_array_value=[1]))
    assert (value['bool_array_value'], value['integer_array_value']) == ([True, False], [1])


@pytest.mark.parametrize(
    ('length', 'expected'),
    [(None, 'Hello World'), (11, 'Hello World'), (5, 'Hello...'), (0, '...')],
)
def test_long_texts_end_in_dots(length: int | None, expected: str) -> None:
    """A text is cut after so many characters."""
    assert to_document(String(data='Hello World'), Abbreviation(length)) == {'data': expected}


def test_arrays_and_texts_can_be_left_out() -> None:
    """Their stand-ins name type and length."""
    cut = Abbreviation(no_arrays=True, no_texts=True)
    document = to_document(joints(), cut)
    assert document['header']['frame_id'] == '<string length: <4>>'
    assert document['name'] == '<sequence type: string, length: 2>'
    assert document['position'] == '<sequence type: double, length: 2>'
    assert document['position'] in to_csv(joints(), cut)
    assert to_document(PoseWithCovariance(), cut)['covariance'] == '<array type: double[36]>'
    points = to_document(Polygon(), cut)['points']
    assert points == '<sequence type: geometry_msgs/msg/Point32, length: 0>'
    bounded = to_document(SolidPrimitive(), cut)['dimensions']
    assert bounded == '<sequence type: double[3], length: 0>'


@pytest.mark.parametrize(
    ('message', 'cut', 'text'),
    [
        (joints(), None, '0,0,base,one,two,0.5,-1.0,,'),
        (Point(x=1.0), None, '1.0,0.0,0.0'),
        (Char(data=65), None, '65'),
        (Empty(), None, ''),
        (Byte(data=b'A'), None, "b'A'"),
        (joints(), Abbreviation(1), '0,0,b...,o...,...,0.5,...,,'),
        (String(data='abc'), Abbreviation(no_texts=True), '<string length: <3>>'),
    ],
)
def test_csv_is_one_line_depth_first(
    message: Message, cut: Abbreviation | None, text: str
) -> None:
    """All values of all levels in order; abbreviations as in YAML, of elements, too."""
    assert to_csv(message, *([] if cut is None else [cut])) == text
