# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Start and end of the programs, and misspelt parameters."""

from __future__ import annotations

from collections.abc import Callable
import difflib
import signal
import sys
import threading

import rclpy
from rclpy.exceptions import ParameterException
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from operator_input import OperatorInputError

from ..exceptions import ServoError
from .exceptions import SettingError

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def run(body: Callable[[threading.Event], None]) -> None:
    """Run a program until it returns; its end is the end of the process.

    Signals end the loop, and never tear it in the middle.

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
    except (ServoError, OperatorInputError, ParameterException) as error:
        sys.stderr.write(f'error: {error}\n')
        sys.exit(1)
    finally:
        try_shutdown()


def refuse_misspelt(node: Node) -> None:
    """Refuse a parameter that looks like one of the node's; rclpy would ignore it.

    Others are left alone: a parameter file may be for several nodes.

    Args:
        node: A node that has declared all its parameters.

    Raises:
        SettingError: There is one; the message says what was meant.
    """
    overrides = node._parameter_overrides  # noqa: SLF001  # there is no public way to ask
    known = list(node.get_parameters_by_prefix(''))
    for name in sorted(name for name in overrides if not node.has_parameter(name)):
        if close := difflib.get_close_matches(name, known, n=1, cutoff=0.75):
            raise SettingError(f'unknown parameter {name!r}; did you mean {close[0]!r}?')
