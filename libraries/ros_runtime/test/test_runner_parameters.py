# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
import re
from typing import Any

from isolation import Isolation
import pytest
import rclpy
from rclpy.node import Node
from rclpy.parameter import Parameter

from node_runner import ParameterError, ParameterReader, refuse_misspelt, refuse_similar

Read = Callable[[ParameterReader], object]
SPAN = (0.5, 2.0)

READS: dict[str, Read] = {
    'number': lambda read: read.number('number', 1.0, SPAN, 'a number [m]'),
    'any': lambda read: read.number('any', 1.0, None, 'a number without a range'),
    'whole': lambda read: read.whole('whole', 3, (0, 9), 'a whole number'),
    'flag': lambda read: read.flag('flag', 'a switch', default=True),
    'text': lambda read: read.text('text', 'base', 'a text'),
    'choice': lambda read: read.choice('choice', 'trot', {'trot': 1, 'crawl': 2}, 'a gait'),
    'numbers': lambda read: read.numbers('numbers', 'some numbers'),
    'texts': lambda read: read.texts('texts', ['a'], 'some texts'),
}


@contextmanager
def node_with(isolation: Isolation, *rules: str) -> Iterator[Node]:
    """Make a node from parameters of a command line."""
    words = [word for rule in rules for word in ('-p', rule)]
    rclpy.init(args=['--ros-args', *words] if words else [], domain_id=isolation.domain_id)
    try:
        node = Node('reader')
        yield node
        node.destroy_node()
    finally:
        rclpy.shutdown()


@pytest.mark.parametrize(
    ('rule', 'value'),
    [
        ('number:=1.5', 1.5),
        ('number:=2', 2.0),
        ('any:=-.inf', float('-inf')),
        ('whole:=9', 9),
        ('flag:=false', False),
        ('text:=map', 'map'),
        ('choice:=crawl', 2),
        ('numbers:=[0.5, 1.0]', (0.5, 1.0)),
        ('numbers:=[1, 2]', (1.0, 2.0)),
        ('texts:=[left, right]', ['left', 'right']),
    ],
)
def test_what_is_given_is_read(isolation: Isolation, rule: str, value: object) -> None:
    """A value of the right kind is returned, and the node returns it to others as well."""
    name = rule.partition(':=')[0]
    with node_with(isolation, rule) as node:
        read = READS[name](ParameterReader(node))
        assert (read, type(read)) == (value, type(value))
        given = node.get_parameter(name).value
        assert name == 'choice' or list(_many(given)) == list(_many(value))


def _many(value: Any) -> Any:
    return value if not isinstance(value, str) and hasattr(value, '__iter__') else [value]


def test_defaults_are_read_and_described(isolation: Isolation) -> None:
    """Without a command line the defaults count; kind, range and meaning can be read."""
    with node_with(isolation) as node:
        read = ParameterReader(node, 'arm.')
        assert [each(read) for each in READS.values()] == [1.0, 1.0, 3, True, 'base', 1, (), ['a']]
        number = node.describe_parameter('arm.number')
        (span,) = number.floating_point_range
        assert (span.from_value, span.to_value) == SPAN
        assert (number.description, number.read_only) == ('a number [m]', True)
        assert number.type == Parameter.Type.DOUBLE.value
        assert node.describe_parameter('arm.whole').integer_range[0].to_value == 9
        assert node.describe_parameter('arm.numbers').type == Parameter.Type.DOUBLE_ARRAY.value
        assert node.describe_parameter('arm.choice').description == 'a gait (trot, crawl)'


@pytest.mark.parametrize(
    ('rule', 'reason'),
    [
        ('number:=9', 'number is 9: it must be 0.5 to 2.0'),
        ('number:=.nan', 'number is nan: it must be a number'),
        ('number:=fast', "number is 'fast': it must be a number"),
        ('number:=true', 'number is True: it must be a number'),
        ('any:=.nan', 'any is nan: it must be a number'),
        ('whole:=1.0', 'whole is 1.0: it must be a whole number'),
        ('whole:=10', 'whole is 10: it must be 0 to 9'),
        ('flag:=1', 'flag is 1: it must be true or false'),
        ('text:=7', 'text is 7: it must be a text'),
        ('choice:=craul', "choice is 'craul': it must be trot or crawl; did you mean 'crawl'?"),
        ('choice:=x', "choice is 'x': it must be trot or crawl"),
        ('numbers:=[a, b]', "numbers is 'a': it must be a number"),
        ('numbers:=1.0', 'numbers is 1.0: it must be a list of numbers'),
        ('numbers:=[.inf]', 'numbers is [inf]: all of them must be finite'),
        ('texts:=map', "texts is 'map': it must be a list of texts"),
    ],
)
def test_what_makes_no_sense_is_refused_with_words(
    isolation: Isolation, rule: str, reason: str
) -> None:
    """The message has the name, the value and what it must be."""
    expected = pytest.raises(ParameterError, match=re.escape(reason) + '$')
    with node_with(isolation, rule) as node, expected:
        READS[rule.partition(':=')[0]](ParameterReader(node))


def test_later_changes(isolation: Isolation) -> None:
    """What is fixed cannot be set; what is not is held within its range."""
    with node_with(isolation) as node:
        ParameterReader(node).number('fixed', 1.0, SPAN, 'set at the start')
        ParameterReader(node, fixed=False).number('live', 1.0, SPAN, 'may change')
        wanted = {'fixed': 1.5, 'live': float('nan')}
        results = [
            node.set_parameters([Parameter(name, value=value)])[0]
            for name, value in [*wanted.items(), ('live', 3.0), ('live', 1.5)]
        ]
        assert [result.successful for result in results] == [False, False, False, True]
        assert node.get_parameter('live').value == 1.5


def test_misspelt_names(isolation: Isolation) -> None:
    """A name like a known one is refused, one for another node and one of rclpy are not."""
    rules = ('velocity:=1', 'qos_overrides./x.publisher.depth:=1', 'nmber:=1.0')
    with node_with(isolation, *rules) as node:
        refuse_misspelt(node)
        READS['number'](ParameterReader(node))
        with pytest.raises(ParameterError, match="'nmber'; did you mean 'number'"):
            refuse_misspelt(node)


def test_other_names_are_left_alone() -> None:
    """Short names that differ in a letter may well be meant for another node."""
    refuse_similar(['gate', 'x', ''], ['rate', 'speed'])
    with pytest.raises(ParameterError, match='speed'):
        refuse_similar(['speeds'], ['speed'])
