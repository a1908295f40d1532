# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the programs that show a robot do once their node is made."""

from __future__ import annotations

from collections.abc import Callable
import threading

from rclpy.node import Node

from node_runner import log_as, notify_ready, spin


def serve(node: Node, seen_at: str, close: Callable[[], None], stop: threading.Event) -> None:
    """Serve a viewer until it is to end, and let its viewers go.

    Args:
        node: The viewer.
        seen_at: Where the robot is seen, in words.
        close: Lets them go.
        stop: Ends it.
    """
    log_as(node)
    notify_ready(seen_at)
    try:
        spin([node], stop)
    finally:
        close()
        node.destroy_node()
