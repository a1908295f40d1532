# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A blocking ROS client for programs that call running nodes step by step.

The package does not import this module: it loads rclpy, which a plain bring-up does not need.
"""

from __future__ import annotations

from collections.abc import Callable, Collection
import time

from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node

from node_runner import init_ros, ServerMatch

from .spec import GivenUpError, no_answer

SPIN = 0.05  # longest time in [s] after which a wait looks whether it shall be given up


class GraphClient:
    """A client with its own node and context; use it in one thread."""

    def __init__(self, name: str, given_up: Callable[[], bool], namespace: str = '') -> None:
        """Join the ROS graph; ``given_up`` returns True to end every wait."""
        self._given_up = given_up
        self._known = set[str]()  # services of which the nodes know this one's clients
        self._context = Context()
        init_ros(context=self._context)
        # the node, for publishers, subscriptions and clients
        self.node = Node(
            name, context=self._context, namespace=namespace or None, enable_rosout=False
        )
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self.node)

    def close(self) -> None:
        """Destroy the node and its context."""
        self._executor.shutdown()
        self.node.destroy_node()
        self._context.try_shutdown()

    def listen(self, duration: float) -> None:
        """Spin for a duration in [s]."""
        end = time.monotonic() + duration
        while (left := end - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def wait_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait for a condition, checked after each callback; times in [s].

        Raises:
            CallError: The condition was not met in time.
            GivenUpError: ``given_up`` returned True.
        """
        end = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > end:
                raise no_answer(what, timeout)
            if self._given_up():
                raise GivenUpError(what)
            self._executor.spin_once(timeout_sec=SPIN)

    def wait_until_known(self, services: Collection[str], timeout: float) -> None:
        """Wait, as :meth:`wait_until`, until servers of services have found our clients."""
        if unknown := set(services) - self._known:
            match = ServerMatch(self.node, unknown)
            self.wait_until(match.advance, timeout, f'the nodes of {", ".join(sorted(unknown))}')
            self._known |= unknown
