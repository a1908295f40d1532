# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""YAML values into messages, and parameter files: round trips, and every refusal by name."""

from __future__ import annotations

from builtin_interfaces.msg import Time
from geometry_msgs.msg import Polygon, PoseWithCovariance, Twist
from hypothesis import given
from hypothesis import strategies as st
import pytest
from rcl_interfaces.msg import ParameterValue
from rclpy.parameter import parameter_value_to_python
from sensor_msgs.msg import JointState
from shape_msgs.msg import SolidPrimitive
from std_msgs.msg import Byte, ByteMultiArray, Float32, Header, Int8, String, UInt8, UInt64
from std_srvs.srv import SetBool, Trigger
import yaml

from ros2_frontend.cli.commands import FieldValueError, FrontendError, UnknownNameError
from ros2_frontend.messages.fill import (
    dump,
    Filler,
    parse_mapping,
    to_document,
    to_yaml,
    values_for,
)
from ros2_frontend.names import Message
from ros2_frontend.verbs.param import parameter, parse_value

NUMBERS = st.floats(allow_nan=False)
TEXTS = st.text(st.characters(codec='utf-8', exclude_characters='\x85\u2028\u2029'), max_size=8)


def filled(message: Message, values: object) -> Message:
    """Fill a message and return it."""
    Filler().fill(message, values)
    return message


@given(
    st.lists(TEXTS, max_size=3),
    st.lists(NUMBERS, max_size=4),
    st.integers(-(2**31), 2**31 - 1),
    st.integers(0, 2**32 - 1),
)
def test_what_echo_prints_pub_takes(
    names: list[str], positions: list[float], sec: int, nanosec: int
) -> None:
    """Message to YAML and back is the same message."""
    message = JointState(name=names, position=positions)
    message.header.stamp = Time(sec=sec, nanosec=nanosec)
    text = to_yaml(to_document(message))
    assert filled(JointState(), parse_mapping(text)) == message


@given(st.lists(st.booleans(), max_size=3), st.lists(st.integers(0, 255), max_size=3))
def test_arrays_of_bools_and_bytes_come_back(bools: list[bool], octets: list[int]) -> None:
    """The element types that Python keeps in lists."""
    values = {'bool_array_value': bools, 'byte_array_value': octets}
    message = filled(ParameterValue(), values)
    assert list(message.bool_array_value) == bools
    assert list(message.byte_array_value) == [bytes([octet]) for octet in octets]


def test_fixed_arrays_and_arrays_of_messages() -> None:
    """36 numbers; two points given as mappings, one of them in part; filling twice adds up."""
    numbers = [float(index) for index in range(36)]
    assert list(filled(PoseWithCovariance(), {'covariance': numbers}).covariance) == numbers
    polygon = filled(Polygon(), {'points': [{'x': 1}, {'x': 2, 'z': 3}]})
    assert [(p.x, p.y, p.z) for p in polygon.points] == [(1.0, 0.0, 0.0), (2.0, 0.0, 3.0)]
    message = filled(Twist(), {'linear': {'x': 1}})
    assert filled(message, {'angular': {'z': 2}}).linear.x == 1.0


@pytest.mark.parametrize('text', ['', '{}', 'null'])
def test_no_values_at_all(text: str) -> None:
    """A request without fields needs no YAML."""
    assert filled(Trigger.Request(), parse_mapping(text)) == Trigger.Request()


@pytest.mark.parametrize(
    ('message', 'text', 'value'),
    [
        (String(), 'data: 10', '10'),
        (String(), 'data: true', 'True'),
        (String(), 'data: ', ''),
        (Float32(), 'data: 3', 3.0),
        (Float32(), 'data: 1e3', 1000.0),
        (Float32(), 'data: .inf', float('inf')),
        (Int8(), 'data: 3.0', 3),
        (Int8(), "data: '-7'", -7),
        (UInt64(), 'data: 0xffffffffffffffff', 2**64 - 1),
        (SetBool.Request(), 'data: 1', True),
        (SetBool.Request(), '{ data: off }', False),
        (Byte(), 'data: 65', b'A'),
        (Byte(), 'data: !!binary QQ==', b'A'),
    ],
)
def test_values_that_fit(message: Message, text: str, value: object) -> None:
    """What people write and what it becomes."""
    assert filled(message, parse_mapping(text)).data == value


@pytest.mark.parametrize(
    ('message', 'text', 'problem'),
    [
        (Int8(), 'data: 128', r"'data' field must be an integer in \[-128, 127\], not 128"),
        (UInt8(), 'data: -1', r"'data' field must be an unsigned integer in \[0, 255\], not -1"),
        (Int8(), 'data: 1.5', r"'data' field must be of type 'int', not 1.5"),
        (Int8(), 'data: .nan', r"'data' field must be of type 'int', not nan"),
        (Int8(), 'data: .inf', r"'data' field must be of type 'int', not inf"),
        (Float32(), 'data: x', r"'data' field must be of type 'float', not 'x'"),
        (Float32(), 'data: true', r"'data' field must be of type 'float', not True"),
        (Float32(), 'data: 1.0e+39', r"'data' field must be a float in \["),
        (SetBool.Request(), "data: 'false'", r"'data' field must be of type 'bool', not 'false'"),
        (String(), 'data: [a]', r"'data' field must be of type 'str'"),
        (Byte(), 'data: 256', r"'data' field must be of type 'bytes'"),
        (ByteMultiArray(), 'data: 5', r"'data' field must be a set or sequence and each value"),
        (JointState(), 'name: ab', r"'name' field must be a set or sequence and each value"),
        (Twist(), 'linear: 1', r"linear: Value '1' is expected to be a dictionary but is a int"),
        (Twist(), 'linear: {w: 1}', r"linear: 'Vector3' object has no attribute 'w'"),
        (
            Polygon(),
            'points: [{x: 1}, {x: a}]',
            r"points\[1\]: The 'x' field must be of type 'flo",
        ),
        (Trigger.Request(), 'data: 1', 'Trigger_Request has no fields'),
        (PoseWithCovariance(), 'covariance: [1.0]', r"'covariance' field must be .* length 36"),
        (SolidPrimitive(), 'dimensions: [1, 2, 3, 4]', r"'dimensions' field must be .*<= 3"),
    ],
)
def test_values_that_do_not_fit(message: Message, text: str, problem: str) -> None:
    """The error names the field, the value and what is taken instead."""
    with pytest.raises(FieldValueError, match=problem):
        filled(message, parse_mapping(text))


def test_an_unknown_field_is_answered_with_those_that_exist() -> None:
    """Their names and types, and the nearest."""
    with pytest.raises(FieldValueError) as caught:
        filled(JointState(), {'postion': [1.0]})
    first, second, third = str(caught.value).splitlines()
    assert first == "'JointState' object has no attribute 'postion'"
    assert second.startswith('JointState has the fields: header (std_msgs/Header), name (seq')
    assert third == "Did you mean 'position'?"


def test_stamps_can_be_left_to_the_moment_of_sending() -> None:
    """`auto` and `now` become setters, when requested."""
    message, filler = JointState(), Filler(expand_now=True)
    filler.fill(message, {'header': 'auto', 'name': ['a']})
    (set_stamp,) = filler.stamps
    set_stamp(Time(sec=7))
    assert (message.header.stamp.sec, message.name) == (7, ['a'])
    header, filler = Header(), Filler(expand_now=True)
    filler.fill(header, {'stamp': 'now', 'frame_id': 'map'})
    filler.stamps[0](Time(sec=8))
    assert (header.stamp.sec, header.frame_id) == (8, 'map')
    with pytest.raises(FieldValueError, match='header: Value'):
        filled(JointState(), {'header': 'auto'})


@pytest.mark.parametrize(
    ('text', 'problem'),
    [
        ('data:1', 'needs to be a dictionary in YAML format .YAML wants a space'),
        ('[1]', 'needs to be a dictionary'),
        ('{a: ', 'is not valid YAML'),
        ('!!python/object/apply:os.getcwd []', 'not valid YAML'),
    ],
)
def test_text_that_is_no_mapping(text: str, problem: str) -> None:
    """The usual slips are named; no Python objects come out of a command line."""
    with pytest.raises(FieldValueError, match=problem):
        parse_mapping(text)


PART = st.from_regex(r'[a-z][a-z0-9_]{0,4}', fullmatch=True)
SCALARS = st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False)
VALUES = st.one_of(
    SCALARS,
    TEXTS,
    st.lists(st.booleans(), max_size=3),
    st.lists(st.integers(-9, 9), min_size=1, max_size=3),
    st.lists(st.floats(allow_nan=False), min_size=1, max_size=3),
    st.lists(TEXTS, min_size=1, max_size=3),
)


@pytest.mark.slow
@given(st.dictionaries(PART, st.dictionaries(PART, VALUES, min_size=1, max_size=2), max_size=3))
def test_dump_and_load_are_inverse(tree: dict[str, dict[str, object]]) -> None:
    """Names with points and values of every type come back, texts like '5' as texts."""
    values = {f'{a}.{b}': value for a, branch in tree.items() for b, value in branch.items()}
    text = dump('/ns/node', values)
    assert values_for('/ns/node', text) == values
    assert text == yaml.safe_dump(yaml.safe_load(text)), 'keys are sorted'


@given(VALUES)
def test_values_survive_the_message(value: object) -> None:
    """Python value to ParameterValue and back."""
    assert parameter_value_to_python(parameter('p', value).value) == value


FILE = """\
/**:
  ros__parameters: {gain: 1.0, everywhere: true}
/ns/node:
  ros__parameters: {gain: 2.0}
short:
  ros__parameters: {gain: 3}
broken: {gain: 1}
"""


def test_a_node_goes_before_all_nodes() -> None:
    """The wildcard gives what the node's own section does not."""
    assert values_for('/ns/node', FILE) == {'gain': 2.0, 'everywhere': True}
    assert values_for('/ns/node', FILE, use_wildcard=False) == {'gain': 2.0}
    assert values_for('/short', FILE, use_wildcard=False) == {'gain': 3}


def test_a_file_without_the_node_names_the_others() -> None:
    """And suggests the nearest."""
    with pytest.raises(UnknownNameError, match=r"for /ns/nod, only .*\nDid you mean '/ns/node'"):
        values_for('/ns/nod', FILE, use_wildcard=False)


@pytest.mark.parametrize(('node', 'text'), [('/broken', FILE), ('/n', 'n: {ros__parameters: 1}')])
def test_a_file_of_another_kind_is_refused(node: str, text: str) -> None:
    """The missing level is named."""
    with pytest.raises(FieldValueError, match="'ros__parameters' is missing"):
        values_for(node, text, use_wildcard=False)


@pytest.mark.parametrize(
    ('text', 'value'),
    [
        ('true', True),
        ('5', 5),
        ('5.0', 5.0),
        ("'5'", '5'),
        ('[1, 2]', [1, 2]),
        ('hello', 'hello'),
        ('', ''),
        ('{a: b', '{a: b'),
        ('{a: b}', '{a: b}'),
    ],
)
def test_what_a_typed_value_means(text: str, value: object) -> None:
    """YAML decides the type; what is no parameter value stays a text, mixed types are refused."""
    assert parse_value(text) == value
    assert parameter_value_to_python(parameter('p', [1, 2.5]).value) == [1.0, 2.5]
    with pytest.raises(FrontendError, match=r"p: no parameter can be \[1, 'x'\]"):
        parameter('p', [1, 'x'])
