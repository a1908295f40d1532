# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What clients of Foxglove publish."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from foxglove.websocket import ClientChannel
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.serialization import deserialize_message

from ...foxglove.names import NameFilter
from .topics import class_of

DEPTH = 10


class ClientPublishers:
    """A publisher for each channel of a client; used in the thread of the node only.

    It ends with the channel, and with the connection: what moves the robot by a stream of messages
    then lacks them, and the robot's own time-out stops it.
    """

    def __init__(self, node: Node, allowed: NameFilter, warn: Callable[[str], None]) -> None:
        self._node, self._allowed, self._warn = node, allowed, warn
        self._publishers: dict[tuple[int, int], Publisher] = {}

    def advertise(self, client: int, channel: ClientChannel) -> None:
        """Make a publisher, or report why there is none."""
        topic = channel.topic
        if not self._allowed.accepts(topic):
            self._warn(f'{topic} is not in client_topic_whitelist; nothing is published to it')
            return
        if channel.encoding != 'cdr':
            self._warn(f'{topic}: encoding {channel.encoding!r} is not supported; send cdr')
            return
        try:
            kind = class_of(channel.schema_name)
            publisher = self._node.create_publisher(kind, topic, DEPTH)
        except (LookupError, InvalidTopicNameException) as error:
            self._warn(f'{topic}: nothing is published to it: {error}')
            return
        self.unadvertise(client, channel.id)
        self._publishers[client, channel.id] = publisher

    def unadvertise(self, client: int, channel: int) -> None:
        """Destroy a publisher."""
        publisher = self._publishers.pop((client, channel), None)
        if publisher is not None:
            self._node.destroy_publisher(publisher)

    def publish(self, client: int, channel: int, data: bytes) -> None:
        """Publish a message; what is none never reaches the topic."""
        publisher = self._publishers.get((client, channel))
        if publisher is None:
            return
        kind: Any = publisher.msg_type
        try:
            message = deserialize_message(data, kind)
        except Exception:  # noqa: BLE001  # rclpy has an error of its own for each middleware
            self._warn(f'{publisher.topic_name}: what came is no {kind.__name__}')
            return
        publisher.publish(message)
