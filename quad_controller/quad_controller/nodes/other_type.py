# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A subscription to a topic that the same process has with another type.

A DDS participant knows one type for each topic, so the other one needs a participant of its own.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
import threading
from typing import Any

import rclpy
from rclpy.context import Context
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.node import Node

from node_runner import init_ros


class OtherTypeSubscription:
    """Calls back in a thread of its own until it is closed."""

    def __init__(
        self, node: Node, kind: type, topic: str, take: Callable[[Any], None], qos: int
    ) -> None:
        """Subscribe to an absolute topic; what DDS raises leaves nothing behind."""
        self._context = Context()
        init_ros([], self._context)
        try:
            self._subscribe(node, kind, topic, take, qos)
        except BaseException:
            rclpy.shutdown(context=self._context)
            raise
        self._thread = threading.Thread(target=self._spin, name=topic, daemon=True)
        self._thread.start()

    def _subscribe(
        self, node: Node, kind: type, topic: str, take: Callable[[Any], None], qos: int
    ) -> None:
        self._node = Node(
            f'{node.get_name()}_{topic.rpartition("/")[2]}',
            context=self._context,
            namespace=node.get_namespace(),
            use_global_arguments=False,
            enable_rosout=False,
            start_parameter_services=False,
        )
        self._node.create_subscription(kind, topic, take, qos)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)

    def close(self) -> None:
        """End it."""
        rclpy.shutdown(context=self._context)
        self._thread.join()

    def _spin(self) -> None:
        with suppress(ExternalShutdownException):
            self._executor.spin()
