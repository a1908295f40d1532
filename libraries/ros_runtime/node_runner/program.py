# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Start and end of a program that runs ROS nodes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
import math
import os
import signal
import socket
import sys
import threading
from time import monotonic

import rclpy
from rclpy.context import Context
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from dds_network import NETWORK_VARIABLE, NetworkChoiceError, restrict_dds
from message_definitions import load_type_support
from realtime_loop import unsettle_memory

from .log_bridge import log_as, RosLogBridge
from .parameter_reader import ParameterError
from .spinning import spin

ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Ctrl-C, what stops services, and the closing of the terminal."""
ECHO_TIME = 0.5
"""A SIGINT this soon after the first signal in [s] is its echo: a key that bounces, or a signal to
a process and to its group."""
NOTIFY_VARIABLE = 'NOTIFY_SOCKET'  # names the socket of the supervisor, as in sd_notify(3)
REFUSED = 1  # exit code of a program that could not begin
HELP_OPTIONS = frozenset({'-h', '--help'})
PLAIN_HELP = """\
usage: {name} --ros-args -p PARAMETER:=VALUE --params-file FILE

The README of its package has its parameters; `ros2 param list /{name}` and
`ros2 param describe /{name} PARAMETER` show them while it runs.
"""
"""What ``--help`` prints of a program that has no other help."""
Body = Callable[[threading.Event], int | None]


def init_ros(args: Sequence[str] | None = None, context: Context | None = None) -> None:
    """Initialise rclpy without its signal handlers, with DDS on the networks that are open.

    A process that can be reached from outside this host logs so, or that it cannot, though asked.

    Args:
        args: Command line; None for the process's own.
        context: What to initialise; None for the default one.

    Raises:
        NetworkChoiceError: ``DDS_NETWORK`` names what does not exist, or would be ignored.
        RuntimeError: ROS does not accept the arguments, or its environment variables.
    """
    reach = restrict_dds(os.environ)
    load_type_support()
    rclpy.init(  # noqa: TID251  # the one place
        args=None if args is None else list(args),
        context=context,
        signal_handler_options=SignalHandlerOptions.NO,
    )
    if reach.without_link or not reach.is_this_host:
        get_logger('dds_network').warning(reach.describe())


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


def notify_ready(status: str = '') -> None:
    """Report ``READY=1`` to the supervisor of this process, if it has one that wants to know.

    That is process_supervisor of this workspace, or systemd for a unit of ``Type=notify``. Only
    the first call reports, so it may stand where readiness comes and goes.

    Args:
        status: What the supervisor shall show the user about this process, in one line.
    """
    address = os.environ.pop(NOTIFY_VARIABLE, '')
    if not address:
        return
    if address.startswith('@'):  # no file: a name in the abstract namespace of Linux
        address = f'\0{address[1:]}'
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as supervisor, suppress(OSError):
        said = f'\nSTATUS={status}' if status else ''
        supervisor.sendto(f'READY=1{said}'.encode(), address)


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
