# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Serve the callbacks of one node until the process is told to end."""

from __future__ import annotations

import signal
import threading

from rclpy.executors import Executor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.utilities import ok

WAKE_PERIOD = 0.1  # [s] how late the end may be noticed


def stop_on_signals() -> threading.Event:
    """Set an event at the first SIGINT or SIGTERM; the second one ends the process at once."""
    stop = threading.Event()

    def handle(number: int, _frame: object) -> None:
        if stop.is_set():
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
        stop.set()

    signal.signal(signal.SIGINT, handle)
    signal.signal(signal.SIGTERM, handle)
    return stop


def spin(node: Node, stop: threading.Event) -> None:
    """Serve a node until an event is set; the node is there afterwards."""
    executor = _make_executor()
    executor.add_node(node)
    try:
        while ok() and not stop.is_set():
            executor.spin_once(timeout_sec=WAKE_PERIOD)
    finally:
        executor.shutdown()


def _make_executor() -> Executor:
    # the events executor costs a third; a multi-threaded one hands callbacks out twice (Jazzy)
    try:
        from rclpy.experimental.events_executor import EventsExecutor
    except ImportError:  # rclpy before 7.1.4
        return SingleThreadedExecutor()
    return EventsExecutor()
