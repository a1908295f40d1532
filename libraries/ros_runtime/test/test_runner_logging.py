# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
from __future__ import annotations

from collections.abc import Callable, Iterator
import logging
import signal
import threading
import time
from types import SimpleNamespace

from isolation import Isolation
import pytest
from rcl_interfaces.msg import Log
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile

from node_runner import log_as, RosLogBridge, run_program
from node_runner.log_bridge import LogRateLimit, QUEUE_LENGTH
from node_runner.program import ENDING

TIMEOUT = 30.0  # [s]


def test_the_first_records_of_a_source_are_admitted_and_the_others_counted() -> None:
    """A line in a loop logs a burst in each window, and what it loses is counted."""
    limit = LogRateLimit(burst=3, window=1.0)
    admitted = [limit.admit('loop', 0.01 * n) for n in range(10)]
    assert admitted == [True] * 3 + [False] * 7
    assert limit.admit('other', 0.5)
    assert limit.collect(0.99) == {}
    assert limit.collect(1.0) == {'loop': 7}
    assert limit.admit('loop', 1.0)
    assert not limit.idle
    assert limit.collect(2.0) == {}
    assert limit.idle


class Sink:
    """A logger that is as slow as the test wants."""

    def __init__(self) -> None:
        self.open = threading.Event()
        self.lines: list[tuple[str, str]] = []

    def __getattr__(self, level: str) -> Callable[[str], None]:
        """Return the method of a level."""

        def take(message: str) -> None:
            assert self.open.wait(TIMEOUT)
            self.lines.append((level, message))

        return take


def bridge_into(sink: Sink, burst: int) -> RosLogBridge:
    """Begin to log into a sink, as a node does."""
    bridge = RosLogBridge('test', limit=LogRateLimit(burst=burst))
    bridge.start()
    log_as(SimpleNamespace(get_logger=lambda: sink))  # type: ignore[arg-type]
    return bridge


@pytest.fixture
def sink() -> Sink:
    """Make a logger."""
    return Sink()


@pytest.fixture
def bridge(sink: Sink) -> Iterator[RosLogBridge]:
    """Serve a bridge into the sink, which is closed by the test or afterwards."""
    bridge = bridge_into(sink, 10 * QUEUE_LENGTH)
    yield bridge
    sink.open.set()
    bridge.close()


def test_who_logs_never_waits_for_the_log(bridge: RosLogBridge, sink: Sink) -> None:
    """While the log takes nothing, all records are accepted; too many of them are counted."""
    log = logging.getLogger('arm_canopen.master.runner')
    for number in range(QUEUE_LENGTH + 100):
        log.error('cycle %d', number)
    assert not sink.lines  # and all calls have returned
    sink.open.set()
    bridge.close()
    kept = [message for level, message in sink.lines if level == 'error']
    assert kept[:2] == ['cycle 0', 'cycle 1']
    assert QUEUE_LENGTH <= len(kept) <= QUEUE_LENGTH + 1  # one may be on its way
    dropped = QUEUE_LENGTH + 100 - len(kept)
    assert sink.lines[-1][0] == 'warning'
    assert str(dropped) in sink.lines[-1][1]


def test_severity_and_traceback_are_kept(bridge: RosLogBridge, sink: Sink) -> None:
    """Each level has its own in ROS; the traceback of a defect is logged with it."""
    sink.open.set()
    log = logging.getLogger('quad_hardware.link.driver')
    log.info('not of interest')
    log.warning('lost %d frames', 3)
    try:
        _ = 1 // 0
    except ZeroDivisionError:
        log.exception('a defect')
    log.critical('the end')
    bridge.close()
    levels = [level for level, _ in sink.lines]
    assert levels == ['warning', 'error', 'fatal']
    assert sink.lines[0][1] == 'lost 3 frames'
    assert 'ZeroDivisionError' in sink.lines[1][1]


def test_a_flood_is_cut_and_counted() -> None:
    """A defect in each cycle logs a burst, and then how often it came."""
    sink = Sink()
    sink.open.set()
    bridge = bridge_into(sink, 5)
    for _ in range(100):
        logging.getLogger('arm_canopen.master.runner').error('a defect in the CANopen cycle')
    bridge.close()
    assert [level for level, _ in sink.lines] == ['error'] * 5 + ['warning']
    assert '95' in sink.lines[-1][1]


@pytest.fixture
def signal_handlers() -> Iterator[None]:
    """Put back what `run_program` replaces in this process."""
    handlers = {number: signal.getsignal(number) for number in ENDING}
    yield
    for number, handler in handlers.items():
        signal.signal(number, handler)


@pytest.mark.usefixtures('signal_handlers')
def test_what_the_layers_below_log_reaches_rosout(isolation: Isolation) -> None:
    """A record of any package's logger, in any thread, is a message of the node on /rosout."""
    received: list[Log] = []
    context = Context()
    rclpy.init(context=context, domain_id=isolation.domain_id)
    listener = Node('listener', context=context, enable_rosout=False)
    qos = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)  # type: ignore[no-untyped-call]
    listener.create_subscription(Log, '/rosout', received.append, qos)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(listener)

    def body(_stop: threading.Event) -> None:
        node = Node('worker')
        log_as(node)
        log = logging.getLogger('canopen_core.can.socket_bus')
        thread = threading.Thread(target=log.error, args=('bus %s', 'down'))
        thread.start()
        thread.join()
        deadline = time.monotonic() + TIMEOUT
        while not any(each.msg == 'bus down' for each in received):
            assert time.monotonic() < deadline, received
            executor.spin_once(0.05)
        node.destroy_node()  # type: ignore[no-untyped-call]

    try:
        arguments = ['--ros-args', '-r', '__ns:=/left']
        with pytest.MonkeyPatch.context() as patch:
            patch.setenv('ROS_DOMAIN_ID', str(isolation.domain_id))
            assert run_program('worker', body, args=arguments) == 0
        (found,) = (each for each in received if each.msg == 'bus down')
        assert (found.name, found.level) == ('left.worker', 40)
    finally:
        executor.shutdown()
        listener.destroy_node()  # type: ignore[no-untyped-call]
        rclpy.shutdown(context=context)
