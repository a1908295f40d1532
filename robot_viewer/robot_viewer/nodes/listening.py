# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Subscriptions that are there only while somebody looks: each message costs time in Python."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data, QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.subscription import Subscription

LINGER = 5.0
"""How long it goes on after the last look in [s]: a page that is loaded anew needs it at once."""


class Listening:
    """Subscribes to topics as long as somebody looks."""

    def __init__(self, node: Node) -> None:
        self._node = node
        self._makers: list[Callable[[], Subscription]] = []
        self._made: list[Subscription] = []
        self._latest: dict[tuple[Any, Callable[[Any], None]], bytes] = {}
        self._last_look: float | None = None

    @property
    def active(self) -> bool:
        """Whether it is subscribed."""
        return bool(self._made)

    def add(
        self,
        kind: Any,  # noqa: ANN401  # message types have no type
        topic: str,
        take: Callable[[Any], None],
        qos: QoSProfile | int,
        *,
        raw: bool = False,
    ) -> None:
        """Subscribe to a topic while a page is open."""
        maker = partial(self._node.create_subscription, kind, topic, take, qos, raw=raw)
        self._makers.append(maker)
        if self._made:
            self._made.append(maker())

    def add_latest(self, kind: Any, topic: str, take: Callable[[Any], None]) -> None:  # noqa: ANN401
        """Subscribe likewise; only the last message before each :meth:`take_latest` is decoded."""
        keep = partial(self._latest.__setitem__, (kind, take))
        self.add(kind, topic, keep, qos_profile_sensor_data, raw=True)

    def take_latest(self) -> None:
        """Process the last message of each topic that is new."""
        while self._latest:
            (kind, take), message = self._latest.popitem()
            take(deserialize_message(message, kind))

    def update(self, now: float, *, looked_at: bool) -> bool:
        """Begin or end; return whether it has just begun."""
        if looked_at:
            self._last_look = now
            begins = not self._made
            if begins:
                self._made = [maker() for maker in self._makers]
            return begins
        if self._made and self._last_look is not None and now - self._last_look > LINGER:
            for subscription in self._made:
                self._node.destroy_subscription(subscription)
            self._made = []
        return False
