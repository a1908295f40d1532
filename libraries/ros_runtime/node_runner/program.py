# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Start and end of a program that runs ROS nodes."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from functools import wraps
import math
import os
from pathlib import Path
import signal
import socket
import sys
import threading
import time
from time import monotonic
import traceback
from typing import Concatenate, ParamSpec, TypeVar

import rclpy
from rclpy.context import Context
from rclpy.exceptions import NameValidationException, ParameterException
from rclpy.executors import Executor, ExternalShutdownException, SingleThreadedExecutor
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import ok, try_shutdown

from black_box import BlackBoxSettings, default_folder, WINDOW, WINDOW_MAX
from dds_network import NETWORK_VARIABLE, NetworkChoiceError, restrict_dds
from message_definitions import load_type_support
from realtime_loop import PRIORITY_MAX, raise_priority, settle_memory, unsettle_memory

from .log_bridge import log_as, RosLogBridge
from .parameter_reader import ParameterError, ParameterReader

AnyNode = TypeVar('AnyNode', bound=Node)
Arguments = ParamSpec('Arguments')
Constructor = Callable[Concatenate[AnyNode, Arguments], None]


def destroyed_when_refused(
    construct: Constructor[AnyNode, Arguments],
) -> Constructor[AnyNode, Arguments]:
    """Decorate the ``__init__`` of a node: when it raises, the node is destroyed first.

    rclpy adds a node to the graph at the start of its constructor, and the participant answers as
    long as the process lives, even if the constructor fails.
    """

    @wraps(construct)
    def guarded(node: AnyNode, /, *args: Arguments.args, **options: Arguments.kwargs) -> None:
        with destroyed_if_refused(node):
            construct(node, *args, **options)

    return guarded


@contextmanager
def destroyed_if_refused(node: AnyNode) -> Iterator[AnyNode]:
    """Destroy a node if the block raises, else keep it.

    For functions that create a plain ``Node`` and then read its parameters; use an ``ExitStack``
    for several nodes.
    """
    try:
        yield node
    except BaseException:
        _destroy(node)
        raise


def _destroy(node: Node) -> None:
    try:
        node.destroy_node()
    except AttributeError:  # not even the constructor of Node came to its end
        with suppress(AttributeError):
            node.handle.destroy_when_not_in_use()


def declare_black_box(read: ParameterReader) -> BlackBoxSettings | None:
    """Declare ``black_box_window`` and ``black_box_folder``; return None if it is off."""
    window = read.number(
        'black_box_window',
        WINDOW,
        (0.0, WINDOW_MAX),
        'how much is written when a fault happens [s]; 0 for nothing',
    )
    folder = read.text(
        'black_box_folder',
        '',
        'where that goes; by default black_box beside the logs of ROS (~/.ros/log/black_box)',
    )
    if window == 0.0:
        return None
    return BlackBoxSettings(Path(folder).expanduser() if folder else default_folder(), window)


def declare_thread_priority(read: ParameterReader, default: int) -> int:
    """Declare ``thread_priority``, as in ros2_control; return its value."""
    return read.whole(
        'thread_priority',
        default,
        (0, PRIORITY_MAX),
        'SCHED_FIFO priority of the thread of the cycle; 0 for none',
    )


def raise_thread_priority(node: Node, priority: int, what: str) -> None:
    """Raise the priority of the calling thread; if refused, log a warning with the remedy."""
    outcome = raise_priority(priority, what)
    if outcome.granted:
        node.get_logger().info(outcome.text)
    elif outcome.text:
        node.get_logger().warning(outcome.text)


def settle_process_memory(node: Node) -> None:
    """Freeze the garbage collector and lock the memory, before the cycle starts."""
    node.get_logger().info(settle_memory().text)


WAKE_PERIOD = 0.1  # how late the end may be noticed, in [s]

LINGER = 0.3
"""Time in [s] for an action to handle the end of its goal, and to deliver the result."""


SIMULATED_TIME = (
    'use_sim_time is true: stamps follow /clock, and what is done periodically stands still until '
    'that is published; control cycles, time-outs and ages keep the time of this computer. Leave '
    'use_sim_time out where nothing publishes /clock'
)

REPEAT_PERIOD = 10.0  # time in [s] in which the same defect of callbacks is logged once


def make_executor() -> Executor:
    """Return an events executor if rclpy has one, else a single-threaded one.

    A MultiThreadedExecutor is unsuitable: in Jazzy it dispatches queued tasks repeatedly while its
    workers wait for the interpreter lock (rclpy issue 1452).
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
    """Spin nodes until an event is set, or until ``rclpy.shutdown``.

    The caller destroys the nodes afterwards. Nodes with simulated time are logged once, with what
    that does not cover.

    Args:
        stop: Ends spinning within :data:`WAKE_PERIOD`.
        executor: Spins the nodes; None for that of :func:`make_executor`.
        linger: Time to keep spinning after ``stop`` in [s], see :data:`LINGER`.
        survive: Called with the exception of a callback, then spinning continues; None raises it.
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
    """Return a ``survive`` for :func:`spin` that logs exceptions of callbacks, with their place.

    For programs with several clients or robots that other threads move: a defect in the answer to
    one client ends neither the others nor the motion.
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
    """Spin nodes while a thread works; its exception is raised here when both have ended.

    The event ends both: ``work`` must end soon after it, and its end sets the event.
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


ENDING = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
"""Ctrl-C, the stop of a service, and the closing of the terminal."""
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
"""Output of ``--help`` for programs without their own help."""
Body = Callable[[threading.Event], int | None]


def init_ros(args: Sequence[str] | None = None, context: Context | None = None) -> None:
    """Initialise rclpy without its signal handlers, with DDS on the networks that the user chose.

    It logs if the process is reachable from other hosts, or is not although requested. The command
    line is that of the process by default.

    Raises:
        NetworkChoiceError: ``DDS_NETWORK`` names something unknown, or would be ignored.
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
    """Set an event at the first signal of :data:`ENDING`, without interrupting the program.

    A second SIGINT, later than :data:`ECHO_TIME`, ends the process at once, except a ``patient``
    one, which must restore its terminal. A second SIGTERM or SIGHUP does not: ``ros2 launch`` and
    others send one if the first signal seems to have no effect, while a robot comes to rest. A
    SIGHUP that is already ignored stays ignored, as ``nohup`` requires.

    Initialise rclpy by :func:`.init_ros`; :func:`.run_program` does both.
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
    """Report ``READY=1`` to the supervisor of this process, if one waits for it.

    That is process_supervisor of this workspace, or systemd for a unit of ``Type=notify``. Only
    the first call reports, so repeated calls are harmless. The supervisor shows the user
    ``status``, one line about this process.
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
    """Run a program until it returns; signals request its end, but never interrupt it.

    Rejected parameters, invalid ROS arguments and the given errors are logged as one line. Any
    other exception is a defect, logged with its traceback. Records of Python's ``logging`` appear
    in the ROS log, see :class:`.RosLogBridge`.

    Args:
        body: Creates and spins the nodes; ends soon after the event is set, by Ctrl-C, SIGTERM or
            the closing of the terminal. May return an exit code.
        *errors: Further exceptions that are logged as one line.
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
    """Run one node that needs only its callbacks; return the exit code.

    As :func:`run_program`: the errors are logged as one line when the node cannot be made.
    """

    def body(stop: threading.Event) -> None:
        node = make()
        log_as(node)
        try:
            spin([node], stop)
        finally:
            node.destroy_node()

    return run_program(name, body, *errors, args=args)
