# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Topics of Foxglove's clients, as bytes: subscribed while one wants them, and published to."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib import import_module
import re
from typing import Any

from foxglove import Channel, Context, Schema
from foxglove.websocket import ClientChannel
from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

from message_definitions import DefinitionError, message_definition

EVERYTHING = '.*'
UNKNOWN_DEPTH, MAX_DEPTH = 10, 25
"""Depth for a publisher whose depth is unknown, since DDS does not report it, and the greatest of
a subscription."""
PUBLISHER_DEPTH = 10


class NameFilter:
    """Accepts names that one of its expressions matches from begin to end."""

    def __init__(self, patterns: Iterable[str]) -> None:
        """Compile them.

        Raises:
            ValueError: One of them is none; the message has it and the reason.
        """
        self._patterns = [_compiled(pattern) for pattern in patterns]

    def accepts(self, name: str) -> bool:
        """Whether a name is to be shown."""
        return any(pattern.fullmatch(name) for pattern in self._patterns)


def is_hidden(name: str) -> bool:
    """Whether ROS hides a name: a part of it begins with an underscore."""
    return any(part.startswith('_') for part in name.split('/'))


def _compiled(pattern: str) -> re.Pattern[str]:
    try:
        return re.compile(pattern)
    except re.error as error:
        raise ValueError(f'{pattern!r} is no regular expression: {error}') from None


@dataclass(slots=True)
class _Offered:
    """A topic on the server.

    Attributes:
        type: Name of its type.
        kind: Class of its messages.
        channel: Its channel on the server.
        clients: Numbers of the clients that want it, once for each of their subscriptions.
        subscription: There while a client wants it.
        qos: Of the subscription.
    """

    type: str
    kind: Any
    channel: Channel
    clients: list[int] = field(default_factory=list)
    subscription: Subscription | None = None
    qos: QoSProfile | None = None


class Topics:
    """Offers topics, and passes their messages on; used in the thread of the node only."""

    def __init__(
        self, node: Node, context: Context, shown: NameFilter, warn: Callable[[str], None]
    ) -> None:
        self._node, self._context, self._shown, self._warn = node, context, shown, warn
        self._offered: dict[str, _Offered] = {}
        self._refused: set[tuple[str, str]] = set()

    def look(self, topics: Iterable[tuple[str, Sequence[str]]]) -> None:
        """Offer what has appeared, withdraw what has gone, by names and types of all topics."""
        wanted = {
            name: types[0]
            for name, types in topics
            if self._shown.accepts(name) and not is_hidden(name)
        }
        for name, offered in list(self._offered.items()):
            if wanted.get(name) != offered.type:
                self._unsubscribe(offered)
                offered.channel.close()
                del self._offered[name]
        for name, kind in wanted.items():
            if name not in self._offered:
                self._offer(name, kind)
        for name, offered in self._offered.items():
            if offered.clients and offered.qos != self._qos(name):
                self._subscribe(name, offered)  # a publisher came or went

    def want(self, client: int, topic: str) -> None:
        """Subscribe for a client; it gets what publishers keep, too."""
        offered = self._offered.get(topic)
        if offered is None:
            return
        offered.clients.append(client)
        latched = offered.qos and offered.qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
        if offered.subscription is None or latched:
            self._subscribe(topic, offered)

    def leave(self, client: int, topic: str) -> None:
        """End a client's subscription."""
        offered = self._offered.get(topic)
        if offered is None or client not in offered.clients:
            return
        offered.clients.remove(client)
        if not offered.clients:
            self._unsubscribe(offered)

    def _offer(self, name: str, type_: str) -> None:
        if (name, type_) in self._refused:
            return
        try:
            kind = class_of(type_)
            definition = message_definition(type_)
        except (DefinitionError, LookupError) as error:
            self._refused.add((name, type_))
            self._warn(f'{name} is not shown: {error}')
            return
        schema = Schema(name=type_, encoding='ros2msg', data=definition.encode())
        channel = Channel(name, schema=schema, message_encoding='cdr', context=self._context)
        self._offered[name] = _Offered(type_, kind, channel)

    def _subscribe(self, name: str, offered: _Offered) -> None:
        self._unsubscribe(offered)
        offered.qos = self._qos(name)
        offered.subscription = self._node.create_subscription(
            offered.kind, name, partial(self._pass, offered.channel), offered.qos, raw=True
        )

    def _unsubscribe(self, offered: _Offered) -> None:
        if offered.subscription is not None:
            self._node.destroy_subscription(offered.subscription)
            offered.subscription = offered.qos = None

    def _pass(self, channel: Channel, data: bytes) -> None:
        channel.log(data, log_time=self._node.get_clock().now().nanoseconds)

    def _qos(self, name: str) -> QoSProfile:
        """Return what connects to all publishers, and gets what they keep where all keep it."""
        offers = [each.qos_profile for each in self._node.get_publishers_info_by_topic(name)]
        reliable = all(each.reliability == ReliabilityPolicy.RELIABLE for each in offers)
        latched = all(each.durability == DurabilityPolicy.TRANSIENT_LOCAL for each in offers)
        depth = sum(each.depth or UNKNOWN_DEPTH for each in offers)
        return QoSProfile(
            depth=min(max(depth, 1), MAX_DEPTH),
            reliability=ReliabilityPolicy.RELIABLE if reliable else ReliabilityPolicy.BEST_EFFORT,
            durability=DurabilityPolicy.TRANSIENT_LOCAL
            if latched and offers
            else DurabilityPolicy.VOLATILE,
        )


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
            publisher = self._node.create_publisher(kind, topic, PUBLISHER_DEPTH)
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


def class_of(name: str) -> Any:  # noqa: ANN401  # message types have no type
    """Return the class of a message or service, by its name as `package/srv/Name`.

    Raises:
        LookupError: It is not installed.
    """
    try:
        package, folder, base = name.split('/')
        return getattr(import_module(f'{package}.{folder}'), base)
    except (AttributeError, ImportError, ValueError):
        raise LookupError(f'type {name} is not installed') from None
