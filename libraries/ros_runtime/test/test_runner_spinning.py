# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import nullcontext
import threading

from isolation import Isolation
import pytest
import rclpy
from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import try_shutdown

from node_runner import log_defects, make_executor, spin, spin_beside

TIMEOUT = 20.0  # [s]


@pytest.fixture
def node(isolation: Isolation) -> Iterator[Node]:
    """Return a node of its own context."""
    rclpy.init(args=[], domain_id=isolation.domain_id)
    try:
        node = rclpy.create_node('spinner')
        yield node
        node.destroy_node()
    finally:
        try_shutdown()


@pytest.mark.parametrize('make', [make_executor, SingleThreadedExecutor])
@pytest.mark.parametrize('end', ['event', 'shutdown'])
def test_spin_serves_until_the_end(node: Node, make: Callable[[], Executor], end: str) -> None:
    """Callbacks run until the event is set, or the context is shut down from elsewhere."""
    called, stop = threading.Event(), threading.Event()
    node.create_timer(0.005, called.set)

    def finish() -> None:
        called.wait(TIMEOUT)
        stop.set() if end == 'event' else rclpy.shutdown()

    finisher = threading.Thread(target=finish)
    finisher.start()
    spin([node], stop, make())
    finisher.join()
    assert called.is_set()


@pytest.mark.parametrize('simulated', [False, True])
def test_simulated_time_is_said_once(
    isolation: Isolation, capfd: pytest.CaptureFixture[str], *, simulated: bool
) -> None:
    """Timers of a node stand still without /clock, and its cycles do not heed it."""
    arguments = ['--ros-args', '-p', 'use_sim_time:=true'] if simulated else []
    rclpy.init(args=arguments, domain_id=isolation.domain_id)
    try:
        nodes, stop = [rclpy.create_node(name) for name in ('one', 'two')], threading.Event()
        ending = threading.Timer(0.3, stop.set)
        ending.start()
        spin(nodes, stop)
        ending.join()
        said = capfd.readouterr().err.count('use_sim_time is true: stamps follow /clock')
        assert said == int(simulated)
        for node in nodes:
            node.destroy_node()
    finally:
        try_shutdown()


@pytest.mark.parametrize('make', [make_executor, SingleThreadedExecutor])
def test_what_a_callback_raises_ends_nothing_where_it_is_reported(
    node: Node, make: Callable[[], Executor], capfd: pytest.CaptureFixture[str]
) -> None:
    """The same callback, and the others, are called again; without a report it is raised."""
    stop, reported, others = threading.Event(), list[str](), list[int]()

    def fail() -> None:
        raise ValueError('no such thing')

    def report(error: Exception) -> None:
        reported.append(str(error))
        if len(reported) > 2 and others:
            stop.set()

    node.create_timer(0.005, fail)
    node.create_timer(0.005, lambda: others.append(1))
    spin([node], stop, make(), survive=report)
    assert set(reported) == {'no such thing'}
    reported.clear()
    spin([node], stop, make(), linger=0.1, survive=report)
    assert set(reported) == {'no such thing'}, 'while it lingers, too'
    stop.clear()
    node.create_timer(0.3, stop.set)
    spin([node], stop, make(), survive=log_defects(node))
    assert capfd.readouterr().err.count('a callback failed') == 1
    with pytest.raises(ValueError, match='no such thing'):
        spin([node], threading.Event(), make())


def test_spin_lingers(node: Node) -> None:
    """What is due soon after the event is done, as the result of a goal that has just ended."""
    called, stop = threading.Event(), threading.Event()
    stop.set()
    node.create_timer(0.01, called.set)
    spin([node], stop)
    assert not called.is_set()
    spin([node], stop, linger=TIMEOUT / 20)
    assert called.is_set()


@pytest.mark.parametrize('fails', [False, True])
def test_nodes_are_served_while_a_thread_works(node: Node, fails: bool) -> None:
    """Its end ends both, and what it raises is raised where the nodes were served."""
    called, stop = threading.Event(), threading.Event()
    node.create_timer(0.005, called.set)

    def work() -> None:
        assert called.wait(TIMEOUT)
        if fails:
            raise OSError('no disk')

    with pytest.raises(OSError, match='no disk') if fails else nullcontext():
        spin_beside(work, [node], stop, 'work')
    assert stop.is_set()
