# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One ROS context with one hidden node, for the life of one command.

The signal handlers of rclpy stay out: a command ends by `KeyboardInterrupt`, with a context that
still works (`action send_goal` cancels its goal then), and always takes its participant out of the
graph. Executor: `SingleThreadedExecutor`; the multi-threaded one hands callbacks out repeatedly,
and the unbounded spin of the events executor burns a core (rclpy 7.1.6).
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterator
import contextlib
import os
import time

from dds_network import NETWORK_VARIABLE, NetworkChoiceError, restrict_dds
from message_definitions import load_type_support

from ..cli.errors import FrontendError
from ..cli.interrupts import deferred_interrupts
from ..names import Handle

NODE_PREFIX = '_ros2cli'  # a leading underscore hides a node from `ros2 node list`

# Python sees Ctrl-C only between two waits
_LONGEST_WAIT = 0.1  # [s]


class Session:
    """A node and the executor that serves it.

    Attributes:
        node: The node.
    """

    def __init__(self, node: Handle, executor: Handle) -> None:
        self.node = node
        self._executor = executor

    def spin_once(self, timeout: float = _LONGEST_WAIT) -> None:
        """Wait for one callback, at most `timeout` [s], and run it."""
        with deferred_interrupts():
            self._executor.spin_once(timeout_sec=min(timeout, _LONGEST_WAIT))

    def spin_until(self, done: Callable[[], bool], timeout: float | None = None) -> bool:
        """Serve callbacks until a condition holds; return False when `timeout` [s] passes."""
        deadline = None if timeout is None else time.monotonic() + timeout
        while not done():
            left = _LONGEST_WAIT if deadline is None else deadline - time.monotonic()
            if left <= 0.0:
                return False
            self.spin_once(left)
        return True

    def spin(self) -> None:
        """Serve callbacks until Ctrl-C."""
        while True:
            self.spin_once()


@contextlib.contextmanager
def open_session(args: Namespace, node_name: str | None = None) -> Iterator[Session]:
    """Join the ROS graph for one command.

    Args:
        args: Parsed arguments; `use_sim_time` is looked at.
        node_name: Name of the node; None makes a hidden one. It is gone from the graph afterwards.

    Raises:
        FrontendError: The node's name, or another that the session uses, is malformed.
    """
    load_type_support()
    import rclpy
    from rclpy.context import Context
    from rclpy.exceptions import NameValidationException
    from rclpy.executors import SingleThreadedExecutor
    from rclpy.node import Node as RclpyNode
    from rclpy.parameter import Parameter
    from rclpy.signals import SignalHandlerOptions
    from rclpy.validate_node_name import validate_node_name

    try:
        restrict_dds(os.environ)
    except NetworkChoiceError as error:
        raise FrontendError(f'{NETWORK_VARIABLE}: {error}') from None
    context = Context()
    # no log file per command
    rclpy.init(  # noqa: TID251  # restricted above
        args=['--ros-args', '--disable-external-lib-logs'],
        context=context,
        signal_handler_options=SignalHandlerOptions.NO,
    )
    try:
        sim_time = getattr(args, 'use_sim_time', False)
        name = node_name or f'{NODE_PREFIX}_{os.getpid()}'
        validate_node_name(name)  # Node() would clean up after itself, with a warning
        node = RclpyNode(
            name,
            context=context,
            start_parameter_services=False,
            parameter_overrides=[Parameter('use_sim_time', value=True)] if sim_time else None,
        )
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(node)
        try:
            yield Session(node, executor)
        finally:
            executor.shutdown(timeout_sec=0.0)
            node.destroy_node()
    except NameValidationException as error:
        raise FrontendError(str(error)) from None
    finally:
        context.try_shutdown()
