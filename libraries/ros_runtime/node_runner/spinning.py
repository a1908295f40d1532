# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Serve the callbacks of nodes with the executor that costs least."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import threading
import time
import traceback

from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import ok

from .log_bridge import log_as

WAKE_PERIOD = 0.1  # how late the end may be noticed, in [s]

LINGER = 0.3
"""Time in [s] for an action to see the end of its goal, and for the result to reach the client."""


SIMULATED_TIME = (
    'use_sim_time is true: stamps follow /clock, and what is done periodically stands still until '
    'that is published; control cycles, time-outs and ages keep the time of this computer. Leave '
    'use_sim_time out where nothing publishes /clock'
)

REPEAT_PERIOD = 10.0  # time in [s] in which the same defect of callbacks is logged once


def make_executor() -> Executor:
    """Return an events executor where rclpy has one, else a single-threaded one.

    A MultiThreadedExecutor is no choice: in Jazzy it hands queued tasks out again and again
    while its workers wait for the interpreter lock (rclpy issue 1452).
    """
    try:
        from rclpy.experimental.events_executor import EventsExecutor
    except ImportError:  # rclpy before 7.1.4
        return SingleThreadedExecutor()
    return EventsExecutor()


def spin(
    nodes: Iterable[Node],
    stop: threading.Event,
    executor: Executor | None = None,
    *,
    linger: float = 0.0,
    survive: Callable[[Exception], None] | None = None,
) -> None:
    """Serve nodes until an event is set, or until ``rclpy.shutdown``.

    The nodes are still there afterwards; destroying them is up to the caller. Those that were set
    to simulated time are named once, with what that does not cover.

    Args:
        nodes: The nodes to serve.
        stop: Ends it within :data:`WAKE_PERIOD`.
        executor: What serves them; :func:`make_executor` chooses when it is None.
        linger: Time for which they are served after that in [s], see :data:`LINGER`.
        survive: Reports what a callback raised, and the others go on; None raises it here.
    """
    executor = executor or make_executor()
    simulated: list[Node] = []
    for node in nodes:
        executor.add_node(node)
        log_as(node)
        if node.get_parameter('use_sim_time').value:
            simulated.append(node)
    if simulated:  # once for all nodes of a process
        simulated[0].get_logger().warning(SIMULATED_TIME)
    try:
        # the unbounded spin() of some EventsExecutors burns a core and runs nothing
        while ok() and not stop.is_set():
            _spin_once(executor, WAKE_PERIOD, survive)
        end = time.monotonic() + linger
        while ok() and (left := end - time.monotonic()) > 0.0:
            _spin_once(executor, min(left, WAKE_PERIOD), survive)
    except ExternalShutdownException:
        pass
    finally:
        executor.shutdown()


def log_defects(node: Node) -> Callable[[Exception], None]:
    """Return a ``survive`` of :func:`spin` that logs what callbacks raise, with its place.

    For programs whose nodes serve several clients or robots while other threads move these: a
    defect in the answer to one ends neither the others nor the motion.
    """
    logged: dict[str, float] = {}

    def log(error: Exception) -> None:
        text, now = ''.join(traceback.format_exception(error)), time.monotonic()
        if now - logged.get(text, -REPEAT_PERIOD) >= REPEAT_PERIOD:
            logged.clear()
            logged[text] = now
            node.get_logger().error(f'a callback failed, the others go on: {text}')

    return log


def _spin_once(
    executor: Executor, timeout: float, survive: Callable[[Exception], None] | None
) -> None:
    try:
        executor.spin_once(timeout_sec=timeout)
    except ExternalShutdownException:
        raise
    except Exception as error:
        if survive is None:
            raise
        survive(error)


def spin_beside(
    work: Callable[[], None], nodes: Iterable[Node], stop: threading.Event, name: str
) -> None:
    """Serve nodes while a thread works; what it raises is raised here when both have ended.

    Args:
        work: Done in the thread; it has to end soon after the event is set.
        nodes: The nodes to serve.
        stop: Ends both; set when the work is done.
        name: Of the thread.
    """
    failures: list[Exception] = []

    def run() -> None:
        try:
            work()
        except Exception as error:  # noqa: BLE001  # it is raised in the thread that waits
            failures.append(error)
        stop.set()

    thread = threading.Thread(target=run, name=name, daemon=True)
    thread.start()
    try:
        spin(nodes, stop)
    finally:
        stop.set()
        thread.join()
    if failures:
        raise failures[0]
