# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Subscriptions that are there while a page is open, and read when it is drawn."""

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
"""How long it goes on after the last look in [s]: a page that is loaded anew needs it at once."""
NEWEST = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
BETWEEN_LOOKS = QoSProfile(depth=50, reliability=ReliabilityPolicy.BEST_EFFORT)
"""Of topics with several publishers: it keeps what comes from one look to the next.

At rest, with ten looks a second, that holds up to 500 Hz of all publishers together; of more the
oldest is lost.
"""


@dataclass(frozen=True, slots=True)
class Topic:
    """A topic that is read."""

    kind: Any  # class of its messages
    name: str
    take: Callable[[Any], bool | None]
    """Takes the newest message; for some it returns whether such ones are of no interest."""
    qos: QoSProfile  # of the subscription
    by: Callable[[bytes], Hashable]  # of messages that differ in this, each newest one is taken


def joints_of(data: bytes) -> Hashable:
    """Return the frame of a JointState and the names of its joints."""
    frame, at = _strings(data, 12, 1)  # behind its stamp
    joints, _ = _strings(data, at + 4, _whole(data, at))
    return frame + joints


def frames_of(data: bytes) -> Hashable:
    """Return the names of all frames of a TFMessage."""
    frames, at = tuple[bytes, ...](), 8
    while at < len(data):
        pair, at = _strings(data, at + 8, 2)  # behind a stamp
        frames += pair
        at += (4 - at) % 8 + 56  # seven doubles; CDR aligns them from behind its head of 4 bytes
    return frames


def _strings(data: bytes, at: int, count: int) -> tuple[tuple[bytes, ...], int]:
    """Return strings in CDR, without what is between them (any bytes), and the place behind."""
    found = list[bytes]()
    while len(found) < count and at < len(data):
        end = at + 4 + _whole(data, at)
        found.append(data[at + 4 : end])
        at = (end + 3) & ~3
    return tuple(found), at


def _whole(data: bytes, at: int) -> int:
    return int.from_bytes(data[at : at + 4], 'little' if data[1] else 'big')


class Listening:
    """Reads topics as long as a page is open.

    No executor serves the subscriptions, which are in a group of their own: a wake-up for each
    message costs more than all else. At each look the newest message of each kind is decoded.
    """

    def __init__(self, node: Node) -> None:
        self._node = node
        self.group = ReentrantCallbackGroup()
        self._topics: list[Topic] = []
        self._made: list[tuple[Topic, Subscription, set[Hashable]]] = []
        self._last_look: float | None = None

    @property
    def active(self) -> bool:
        """Whether it is subscribed."""
        return bool(self._made)

    def add(
        self,
        kind: Any,  # noqa: ANN401  # message types have no type
        name: str,
        take: Callable[[Any], bool | None],
        qos: QoSProfile = NEWEST,
        by: Callable[[bytes], Hashable] = lambda _: None,
    ) -> None:
        """Read a topic while a page is open, see :class:`Topic`."""
        self._topics.append(Topic(kind, name, take, qos, by))
        if self._made:
            self._subscribe(self._topics[-1])

    def _subscribe(self, topic: Topic) -> None:
        made = self._node.create_subscription(
            topic.kind, topic.name, lambda _: None, topic.qos, callback_group=self.group, raw=True
        )
        self._made.append((topic, made, set()))

    def newest(self) -> Iterator[Callable[[], None]]:
        """Yield what processes each message that is new."""
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
        """Begin or end; return whether it has just begun."""
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
