# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Start and end of the programs: signals end the loop, and never tear it in the middle."""

from __future__ import annotations

from collections.abc import Callable
import signal
import sys
import threading

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from operator_input import OperatorInputError

from ..exceptions import TeleopError

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def run(body: Callable[[threading.Event], None]) -> None:
    """Run a program until it returns; its end is the end of the process.

    Args:
        body: Makes the node and serves it; ends soon after the event is set, by Ctrl-C, SIGTERM or
            the closing of the window.
    """
    stop = threading.Event()
    for number in ENDING:
        signal.signal(number, lambda *_: stop.set())
    rclpy.init(signal_handler_options=SignalHandlerOptions.NO)
    try:
        body(stop)
    except (TeleopError, OperatorInputError, ParameterException) as error:
        sys.stderr.write(f'error: {error}\n')
        sys.exit(1)
    finally:
        try_shutdown()
