# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable, Iterator
import time

from isolation import Isolation
import pytest
import rclpy
from rclpy.context import Context
from rclpy.exceptions import InvalidNodeNameException
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from runner_program import Careful
from std_msgs.msg import String

from node_runner import destroyed_if_refused, destroyed_when_refused, ParameterError

TIMEOUT = 20.0  # [s]


class Late(Node):
    """Is refused when it has all that a node may have."""

    @destroyed_when_refused
    def __init__(self) -> None:
        super().__init__('late')
        self.create_publisher(String, 'late', 1)
        self.create_subscription(String, 'late', lambda _: None, 1)
        self.create_timer(1.0, lambda: None)
        raise ParameterError('no')


class Child(Careful):
    """A subclass, whose own constructor is guarded too."""

    @destroyed_when_refused
    def __init__(self) -> None:
        super().__init__()
        raise ParameterError('no')


class Unnamed(Node):
    """Cannot even begin."""

    @destroyed_when_refused
    def __init__(self) -> None:
        super().__init__('no name')


@pytest.fixture
def watcher(isolation: Isolation) -> Iterator[Node]:
    """Watch the graph from another context, thus another participant."""
    context = Context()
    rclpy.init(context=context, domain_id=isolation.domain_id)
    node = Node('watcher', context=context)
    yield node
    node.destroy_node()
    rclpy.shutdown(context=context)


def until(node: Node, condition: Callable[[], bool]) -> None:
    """Serve a node until something is true of it."""
    executor = SingleThreadedExecutor(context=node.context)
    executor.add_node(node)
    deadline = time.monotonic() + TIMEOUT
    while not condition():
        assert time.monotonic() < deadline, node.get_node_names()
        executor.spin_once(0.05)
    executor.shutdown()


@pytest.mark.parametrize(
    ('make', 'words', 'error'),
    [
        (Careful, ['-p', 'rate:=fast'], ParameterError),
        (Careful, ['-p', 'ratte:=5.0'], ParameterError),
        (Late, [], ParameterError),
        (Child, [], ParameterError),
        (Careful, ['-p', 'start_type_description_service:=5'], Exception),
        (Unnamed, [], InvalidNodeNameException),
    ],
)
def test_a_refused_node_leaves_nothing_in_the_graph(
    isolation: Isolation,
    watcher: Node,
    make: Callable[[], Node],
    words: list[str],
    error: type[Exception],
) -> None:
    """Neither its own participant nor another one knows of a node whose constructor raised."""
    rclpy.init(args=['--ros-args', *words] if words else [], domain_id=isolation.domain_id)
    try:
        try:
            made = make()
        except error as refused:  # held, as a test or a traceback would
            kept = refused
        else:
            pytest.fail(f'{made} was not refused')
        marker = Node('marker', use_global_arguments=False)
        # the watcher is there already where the machine is slow
        assert set(marker.get_node_names()) <= {'marker', 'watcher'}, kept
        assert not [name for name, _ in marker.get_topic_names_and_types() if 'late' in name]
        # what comes later is known, so what came before would be
        until(watcher, lambda: 'marker' in watcher.get_node_names())
        assert sorted(watcher.get_node_names()) == ['marker', 'watcher']
        marker.destroy_node()
    finally:
        rclpy.shutdown()


def test_the_last_refused_node_takes_the_participant_along(
    isolation: Isolation, watcher: Node
) -> None:
    """When all nodes of a context are gone, others see nothing of its process any more."""
    rclpy.init(args=[], domain_id=isolation.domain_id)
    try:
        node = Node('announced')
        until(watcher, lambda: 'announced' in watcher.get_node_names())
        with pytest.raises(ParameterError), destroyed_if_refused(node):
            raise ParameterError('no')
        until(watcher, lambda: watcher.get_node_names() == ['watcher'])
    finally:
        rclpy.shutdown()


def test_a_node_that_is_not_refused_stays(isolation: Isolation) -> None:
    """Neither the decorator nor the context touches a node that is in order."""
    rclpy.init(args=[], domain_id=isolation.domain_id)
    try:
        with destroyed_if_refused(Careful()) as node:
            pass
        assert node.get_node_names() == ['careful']
        assert node.get_parameter('rate').value == 10.0
        node.destroy_node()
    finally:
        rclpy.shutdown()
