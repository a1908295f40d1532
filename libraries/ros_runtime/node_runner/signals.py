# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The end of a process by signals."""

from __future__ import annotations

from collections.abc import Callable
import math
import signal
import threading
from time import monotonic

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Ctrl-C, what stops services, and the closing of the terminal."""

ECHO_TIME = 0.5
"""A SIGINT this soon after the first signal in [s] is its echo: a key that bounces, or a signal to
a process and to its group."""


def stop_on_signals(
    *, patient: bool = False, clock: Callable[[], float] = monotonic
) -> threading.Event:
    """Set an event at the first signal of :data:`ENDING`; nothing is torn in the middle.

    A second SIGINT, later than :data:`ECHO_TIME`, ends the process at once. A SIGTERM or SIGHUP
    does not: ``ros2 launch`` and its like send one when the first signal seems to
    do nothing, while a robot comes to rest. A SIGHUP that is ignored already stays so, as
    ``nohup`` wants it.

    Initialise rclpy by :func:`.init_ros`; :func:`.run_program` does both.

    Args:
        patient: Not even a second SIGINT ends the process at once; for programs that have to leave
            a terminal as it was.
        clock: Returns steady time in [s].
    """
    stop = threading.Event()
    first = math.inf

    def handle(number: int, _frame: object) -> None:
        nonlocal first
        now = clock()
        if now - first >= ECHO_TIME and number == signal.SIGINT and not patient:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
        first = min(first, now)
        stop.set()

    for number in ENDING:
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, handle)
    return stop
