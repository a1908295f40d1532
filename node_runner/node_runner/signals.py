# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The end of a process: what signals ask for."""

from __future__ import annotations

import signal
import threading

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Ctrl-C, what stops services, and the closing of the terminal."""


def stop_on_signals(*, patient: bool = False) -> threading.Event:
    """Set an event at the first signal of :data:`ENDING`; nothing is torn in the middle.

    A second SIGINT ends the process at once. A SIGTERM or SIGHUP does not: what stops processes
    (``ros2 launch``, say) sends one when the first signal seems to do nothing, while a robot comes
    to rest. A SIGHUP that is ignored already stays so, as ``nohup`` wants it.

    Initialise rclpy by :func:`.init_ros`; :func:`.run_program` does both.

    Args:
        patient: Not even a second SIGINT ends the process at once; for programs that have to leave
            a terminal as it was.
    """
    stop = threading.Event()

    def handle(number: int, _frame: object) -> None:
        if stop.is_set() and number == signal.SIGINT and not patient:
            signal.signal(number, signal.SIG_DFL)
            signal.raise_signal(number)
        stop.set()

    for number in ENDING:
        if number != signal.SIGHUP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, handle)
    return stop
