# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameter files: what is dumped is loaded again."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest
from rclpy.parameter import parameter_value_to_python

from ros2_frontend.cli.errors import FieldValueError, FrontendError, UnknownNameError
from ros2_frontend.messages.fill import dump, values_for
from ros2_frontend.ros.parameters import parameter, parse_value

PART = st.from_regex(r'[a-z][a-z0-9_]{0,4}', fullmatch=True)
SCALARS = st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.floats(allow_nan=False)
TEXTS = st.text(st.characters(codec='utf-8', exclude_characters='\x85\u2028\u2029'), max_size=6)
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
    assert values_for('/ns/node', dump('/ns/node', values)) == values


@given(VALUES)
def test_values_survive_the_message(value: object) -> None:
    """Python value to ParameterValue and back."""
    assert parameter_value_to_python(parameter('p', value).value) == value


def test_dump_is_ros2clis_to_the_letter() -> None:
    """Keys sorted, points as levels, arrays as blocks."""
    values = {'b.c': [1, 2], 'a': 1.5, 'b.d': 'x', 'use_sim_time': False}
    assert dump('/node', values) == (
        '/node:\n  ros__parameters:\n    a: 1.5\n    b:\n      c:\n      - 1\n      - 2\n'
        '      d: x\n    use_sim_time: false\n'
    )


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
    """YAML decides the type; what is no parameter value stays a text."""
    assert parse_value(text) == value


def test_mixed_numbers_are_floats_and_mixed_types_are_refused() -> None:
    """[1, 2.5] is an array of doubles; [1, x] is nothing."""
    assert parameter_value_to_python(parameter('p', [1, 2.5]).value) == [1.0, 2.5]
    with pytest.raises(FrontendError, match=r"p: no parameter can be \[1, 'x'\]"):
        parameter('p', [1, 'x'])
