# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Serve the callbacks of nodes with the executor that costs least."""

from __future__ import annotations

from collections.abc import Iterable
import signal
import threading

from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import ok

WAKE_PERIOD = 0.1  # [s] how late a shutdown that wakes no executor may be noticed


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


def stop_on_signals() -> threading.Event:
    """Set an event at the first SIGINT or SIGTERM; a second SIGINT ends the process at once.

    A SIGTERM does not: what stops processes (``ros2 launch``, say) sends one when the first
    signal seems to do nothing, while the drives come to rest.

    For programs that must not be interrupted anywhere: initialise rclpy with
    ``SignalHandlerOptions.NO``, call this, and hand the event to :func:`spin`.
    """
    stop = threading.Event()

    def handle(number: int, _frame: object) -> None:
        if stop.is_set() and number == signal.SIGINT:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
        stop.set()

    signal.signal(signal.SIGINT, handle)
    signal.signal(signal.SIGTERM, handle)
    return stop


def spin(
    nodes: Iterable[Node],
    executor: Executor | None = None,
    *,
    stop: threading.Event | None = None,
) -> None:
    """Serve nodes until Ctrl-C, SIGTERM or ``rclpy.shutdown``.

    The nodes are still there afterwards; destroying them is up to the caller.

    Args:
        nodes: The nodes to serve.
        executor: What serves them; :func:`make_executor` chooses when it is None.
        stop: Ends it too when it is set, within :data:`WAKE_PERIOD`.
    """
    stop = stop or threading.Event()
    executor = executor or make_executor()
    for node in nodes:
        executor.add_node(node)
    try:
        # the unbounded spin() of some EventsExecutors burns a core and runs nothing
        while ok() and not stop.is_set():
            executor.spin_once(timeout_sec=WAKE_PERIOD)
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    finally:
        executor.shutdown()
