# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What clients of Foxglove ask for, from the threads of the server to the thread of the node."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import threading

from foxglove import Parameter
from foxglove.websocket import ChannelView, Client, ClientChannel, ServerListener

from .parameters import Parameters
from .publishing import ClientPublishers
from .topics import Topics


class Listener(ServerListener):
    """Called in threads of the server; its names are those of foxglove-sdk."""

    def __init__(
        self,
        order: Callable[[Callable[[], None]], None],
        topics: Topics,
        publishers: ClientPublishers,
        parameters: Parameters | None,
        graph_wanted: threading.Event,
    ) -> None:
        """Pass requests on.

        Args:
            order: Has something done in the thread of the node.
            topics: Subscribes.
            publishers: Publish what clients send.
            parameters: Knows and sets parameters; None where clients may not see them.
            graph_wanted: Set while a client wants the connection graph.
        """
        self._order, self._topics, self._publishers = order, topics, publishers
        self._parameters, self._graph_wanted = parameters, graph_wanted

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

    def on_get_parameters(
        self, client: Client, param_names: list[str], request_id: str | None = None
    ) -> list[Parameter]:
        """Return parameters, all when no name is given."""
        return self._parameters.get(param_names) if self._parameters is not None else []

    def on_set_parameters(
        self, client: Client, parameters: list[Parameter], request_id: str | None = None
    ) -> list[Parameter]:
        """Set parameters, and return what they are then."""
        return self._parameters.set(parameters) if self._parameters is not None else []

    def on_connection_graph_subscribe(self) -> None:
        """Begin to look at the connections."""
        self._graph_wanted.set()

    def on_connection_graph_unsubscribe(self) -> None:
        """End it."""
        self._graph_wanted.clear()
