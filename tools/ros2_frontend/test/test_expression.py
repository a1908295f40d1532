# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Filters and field paths."""

from __future__ import annotations

import pytest
from sensor_msgs.msg import JointState

from ros2_frontend.cli.errors import FrontendError, UnknownNameError
from ros2_frontend.verbs.expression import compile_filter, parse_path, select


@pytest.fixture
def message() -> JointState:
    """Make a message with nested fields and arrays."""
    message = JointState(name=['a', 'b'], position=[0.5, 2.5])
    message.header.stamp.sec = 7
    return message


@pytest.mark.parametrize(
    ('path', 'value'),
    [
        ('header.stamp.sec', 7),
        ('name.[1]', 'b'),
        ('name[1]', 'b'),
        ('position[-1]', 2.5),
        ('.header.stamp.sec.', 7),
    ],
)
def test_a_path_leads_to_a_value(message: JointState, path: str, value: object) -> None:
    """Points for fields, brackets for elements."""
    assert select(message, parse_path(path)) == value


def test_no_path_is_the_message(message: JointState) -> None:
    """Nothing is selected."""
    assert select(message, parse_path(None)) is message


@pytest.mark.parametrize(
    ('path', 'problem'),
    [
        (
            'nam',
            "Invalid field 'nam': 'JointState' object has no attribute 'nam'\nIt has: header",
        ),
        ('header.zzz', "'Header' object has no attribute 'zzz'\nIt has: stamp, frame_id"),
        ('name.[5]', 'Invalid field .* index out of range'),
        ('header.[0]', "'Header' object is not subscriptable"),
    ],
)
def test_a_path_that_leads_nowhere(message: JointState, path: str, problem: str) -> None:
    """The error says how far it went and what is there."""
    with pytest.raises(UnknownNameError, match=problem):
        select(message, parse_path(path))


@pytest.mark.parametrize('text', ['.', '', '...'])
def test_an_empty_path_is_refused(text: str) -> None:
    """As ros2cli does."""
    with pytest.raises(FrontendError, match='Invalid field value'):
        parse_path(text)


def test_filter(message: JointState) -> None:
    """An expression in m; none accepts all."""
    assert compile_filter('m.position[1] > 2 and len(m.name) == 2')(message)
    assert not compile_filter('m.position[1] > 3')(message)
    assert compile_filter(None)(message)


def test_a_filter_that_fails_says_how(message: JointState) -> None:
    """Syntax errors at once, others with the first message."""
    with pytest.raises(FrontendError, match=r"Invalid filter 'm\.\+'"):
        compile_filter('m.+')
    with pytest.raises(FrontendError, match=r"Filter 'm.nothing' failed: .*no attribute"):
        compile_filter('m.nothing')(message)
