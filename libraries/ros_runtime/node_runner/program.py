# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Start and end of a program that runs ROS nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import sys
import threading

from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.utilities import try_shutdown

from dds_network import NETWORK_VARIABLE, NetworkChoiceError
from realtime_loop import unsettle_memory

from .exceptions import ParameterError
from .joining import init_ros
from .log_bridge import log_as, RosLogBridge
from .signals import stop_on_signals
from .spinning import spin

REFUSED = 1
"""Exit code of a program that could not begin."""

HELP_OPTIONS = frozenset({'-h', '--help'})

PLAIN_HELP = """\
usage: {name} --ros-args -p PARAMETER:=VALUE --params-file FILE

The README of its package has its parameters; `ros2 param list /{name}` and
`ros2 param describe /{name} PARAMETER` show them while it runs.
"""
"""What ``--help`` prints of a program that has no other help."""

Body = Callable[[threading.Event], int | None]


def run_program(
    name: str,
    body: Body,
    *errors: type[Exception],
    args: Sequence[str] | None = None,
    patient: bool = False,
    help_text: str | None = None,
) -> int:
    """Run a program until it returns; signals end it, and never tear it in the middle.

    Parameters that are refused, arguments that ROS does not understand and the errors named here
    are one line of the log. Everything else is a defect, and has its traceback. Records of
    Python's ``logging`` appear in the log of ROS, see :class:`.RosLogBridge`.

    Args:
        name: Name for the log.
        body: Makes the nodes and serves them; ends soon after the event is set, by Ctrl-C, SIGTERM
            or the closing of the terminal. May return an exit code.
        *errors: What else is logged as one line.
        args: Command line; None for the process's own.
        patient: As in :func:`.stop_on_signals`.
        help_text: Printed for ``--help``, which starts nothing; None for :data:`PLAIN_HELP`.

    Returns:
        Exit code: that of the body, or 1 when it raised one of the errors.
    """
    if HELP_OPTIONS.intersection(sys.argv[1:] if args is None else args):
        sys.stdout.write(help_text or PLAIN_HELP.format(name=name))
        return 0
    stop = stop_on_signals(patient=patient)
    try:
        init_ros(args)
    except NetworkChoiceError as error:
        get_logger(name).fatal(f'{NETWORK_VARIABLE}: {error}')
        return REFUSED
    except RuntimeError as error:  # rcl has no finer class for all of them
        get_logger(name).fatal(f'ROS does not take these arguments: {error}')
        return REFUSED
    refusals: tuple[type[Exception], ...] = (
        ParameterError,
        ParameterException,
        NameValidationException,
        *errors,
    )
    bridge = RosLogBridge(name)
    bridge.start()
    try:
        return body(stop) or 0
    except refusals as error:
        get_logger(name).fatal(str(error))
        return REFUSED
    finally:
        bridge.close()
        try_shutdown()
        unsettle_memory()


def run_node(
    name: str,
    make: Callable[[], Node],
    *errors: type[Exception],
    args: Sequence[str] | None = None,
) -> int:
    """Run one node that needs no more than its callbacks.

    Args:
        name: Name for the log.
        make: Makes the node.
        *errors: What is logged as one line when it cannot be made.
        args: Command line; None for the process's own.

    Returns:
        Exit code: 0, or 1 when the node could not be made.
    """

    def body(stop: threading.Event) -> None:
        node = make()
        log_as(node)
        try:
            spin([node], stop)
        finally:
            node.destroy_node()

    return run_program(name, body, *errors, args=args)
