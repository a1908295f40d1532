# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The node of the page beside one of a test, which is what the page meets."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from unittest.mock import patch

from isolation import Isolation
import rclpy
from rclpy.node import Node
from ros_client import destroy_with_actions

from node_runner import make_executor
from robot_viewer.nodes import web_viewer

TIMEOUT = 60.0  # [s]


class ViewerRig:
    """Serves both nodes.

    Attributes:
        node: That of the test.
        viewer: That of the page.
    """

    def __init__(self, node: Node) -> None:
        """Start a page, which looks around ten times as often as it does for people."""
        self.node = node
        with patch.object(web_viewer, 'GRAPH_PERIOD', 0.1):
            self.viewer = web_viewer.WebViewer()
        self._executor = make_executor()
        self._executor.add_node(node)
        self._executor.add_node(self.viewer)

    @property
    def said(self) -> str:
        """What the page says, for a test that fails."""
        return ''

    def spin_until(self, condition: Callable[[], bool], what: str) -> None:
        """Serve both nodes until something is true."""
        deadline = self.node.get_clock().now().nanoseconds + TIMEOUT * 1e9
        while not condition():
            assert self.node.get_clock().now().nanoseconds < deadline, f'{what}: {self.said}'
            self._executor.spin_once(0.05)

    def spin_times(self, count: int) -> None:
        """Serve both nodes for a while, in which nothing is to happen."""
        for _ in range(count):
            self._executor.spin_once(0.02)

    def close(self) -> None:
        """End both, and leave their domain, in which an executor keeps nodes."""
        self.viewer.page.close()
        self._executor.shutdown()
        for node in (self.viewer, self.node):
            destroy_with_actions(node)


@contextmanager
def in_domain(isolation: Isolation, parameter: str) -> Iterator[None]:
    """Let nodes of a test be in its domain, with a parameter for the page."""
    rclpy.init(args=['--ros-args', '-p', parameter], domain_id=isolation.domain_id)
    try:
        yield
    finally:
        rclpy.shutdown()
