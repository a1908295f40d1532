# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What clients of Foxglove request, from the threads of the server to the thread of the node."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from foxglove.websocket import ChannelView, Client, ClientChannel, ServerListener

from .publishing import ClientPublishers
from .topics import Topics


class Listener(ServerListener):
    """Called in threads of the server; its names are those of foxglove-sdk."""

    def __init__(
        self,
        order: Callable[[Callable[[], None]], None],
        topics: Topics,
        publishers: ClientPublishers,
    ) -> None:
        """Pass requests on; ``order`` runs something in the thread of the node."""
        self._order, self._topics, self._publishers = order, topics, publishers

    def on_subscribe(self, client: Client, channel: ChannelView) -> None:
        """Subscribe."""
        self._order(partial(self._topics.want, client.id, channel.topic))

    def on_unsubscribe(self, client: Client, channel: ChannelView) -> None:
        """End a subscription, also of a client that has gone."""
        self._order(partial(self._topics.leave, client.id, channel.topic))

    def on_client_advertise(self, client: Client, channel: ClientChannel) -> None:
        """Make a publisher."""
        self._order(partial(self._publishers.advertise, client.id, channel))

    def on_client_unadvertise(self, client: Client, client_channel_id: int) -> None:
        """Destroy a publisher, also of a client that has gone."""
        self._order(partial(self._publishers.unadvertise, client.id, client_channel_id))

    def on_message_data(self, client: Client, client_channel_id: int, data: bytes) -> None:
        """Publish a message."""
        self._order(partial(self._publishers.publish, client.id, client_channel_id, data))
