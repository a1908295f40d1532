# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Subscriptions that exist while a page is open, and are read when it is drawn."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterator
from dataclasses import dataclass
from functools import partial
from typing import Any

from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.node import Node
from rclpy.qos import QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

LINGER = 5.0
"""Time in [s] that subscriptions outlive the last open page: a reload needs them immediately."""
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
BETWEEN_LOOKS = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
"""QoS for topics with several publishers: buffers the messages between two reads.

At rest, with ten reads per second, it buffers up to 500 Hz of all publishers together; beyond
that the oldest messages are lost.
"""


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic to read, and its handler."""

    kind: Any  # class of its messages
    name: str
    take: Callable[[Any], bool | None]
    """Handles the newest message; may return True to ignore messages with this key from now on."""
    qos: QoSProfile  # of the subscription
    by: Callable[[bytes], Hashable]  # key of a message; the newest one per key is handled


def joints_of(data: bytes) -> Hashable:
    """Return the frame of a JointState and the names of its joints."""
    frame, at = _strings(data, 12, 1)  # after its stamp
    joints, _ = _strings(data, at + 4, _whole(data, at))
    return frame + joints


def frames_of(data: bytes) -> Hashable:
    """Return the names of all frames of a TFMessage."""
    frames, at = tuple[bytes, ...](), 8
    while at < len(data):
        pair, at = _strings(data, at + 8, 2)  # after a stamp
        frames += pair
        at += (4 - at) % 8 + 56  # seven doubles, aligned from the end of CDR's 4-byte header
    return frames


def _strings(data: bytes, at: int, count: int) -> tuple[tuple[bytes, ...], int]:
    """Return consecutive CDR strings without padding (any bytes), and the offset after them."""
    found = list[bytes]()
    while len(found) < count and at < len(data):
        end = at + 4 + _whole(data, at)
        found.append(data[at + 4 : end])
        at = (end + 3) & ~3
    return tuple(found), at


def _whole(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 4], 'little' if data[1] else 'big')


class Listening:
    """Reads topics while a page is open.

    No executor serves the subscriptions, which have their own callback group: a wake-up per
    message costs more than all else. Each read decodes only the newest message of each key.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self.group = ReentrantCallbackGroup()
        self._topics: list[Topic] = []
        self._made: list[tuple[Topic, Subscription, set[Hashable]]] = []
        self._last_look: float | None = None

    @property
    def active(self) -> bool:
        """Whether the topics are subscribed."""
        return bool(self._made)

    def add(
        self,
        kind: Any,  # noqa: ANN401  # message types have no type
        name: str,
        take: Callable[[Any], bool | None],
        qos: QoSProfile = NEWEST,
        by: Callable[[bytes], Hashable] = lambda _: None,
    ) -> None:
        """Add a topic; see :class:`Topic`."""
        self._topics.append(Topic(kind, name, take, qos, by))
        if self._made:
            self._subscribe(self._topics[-1])

    def _subscribe(self, topic: Topic) -> None:
        made = self._node.create_subscription(
            topic.kind, topic.name, lambda _: None, topic.qos, callback_group=self.group, raw=True
        )
        self._made.append((topic, made, set()))

    def newest(self) -> Iterator[Callable[[], None]]:
        """Yield one function per new message, which processes it."""
        for topic, subscription, dropped in self._made:
            found = dict[Hashable, bytes]()
            with subscription.handle:
                for _ in range(topic.qos.depth):
                    taken = subscription.handle.take_message(topic.kind, True)
                    if taken is None:
                        break
                    found[topic.by(taken[0])] = taken[0]
            for key in (each for each in found if each not in dropped):
                yield partial(self._process, topic, dropped, key, found[key])

    @staticmethod
    def _process(topic: Topic, dropped: set[Hashable], key: Hashable, data: bytes) -> None:
        if topic.take(deserialize_message(data, topic.kind)):
            dropped.add(key)

    def update(self, now: float, *, looked_at: bool) -> bool:
        """Subscribe or unsubscribe; return whether it has just subscribed."""
        if looked_at:
            self._last_look = now
            begins = not self._made
            if begins:
                for topic in self._topics:
                    self._subscribe(topic)
            return begins
        if self._made and self._last_look is not None and now - self._last_look > LINGER:
            for _, subscription, _ in self._made:
                self._node.destroy_subscription(subscription)
            self._made = []
        return False
