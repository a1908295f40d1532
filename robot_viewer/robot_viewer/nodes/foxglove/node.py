# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bridge: a server of Foxglove's protocol beside the robot."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from socket import gethostname
from urllib.parse import quote

from foxglove import Context, start_server, StatusLevel
from foxglove.websocket import Capability
from rclpy.node import Node

from node_runner import destroyed_when_refused

from ...exceptions import BridgeError
from ...foxglove.admission import Admission
from ...foxglove.assets import read_asset
from ...foxglove.relay import hidden_address, Relay
from .listener import Listener
from .publishing import ClientPublishers
from .services import Services
from .settings import read_settings, Settings
from .topics import Topics

LOOK_PERIOD = 1.0
"""Time between two looks at the graph in [s]."""


class FoxgloveBridge(Node):
    """A server of Foxglove's protocol beside the robot.

    Clients are served in threads of foxglove-sdk. What they request is left for the node's thread;
    only calls of services wait there, each for its own client.
    """

    @destroyed_when_refused
    def __init__(self, name: str) -> None:
        """Listen.

        Raises:
            ParameterError: A parameter is wrong.
            BridgeError: The port is in use.
        """
        super().__init__(name)
        settings = read_settings(self)
        self._orders: deque[Callable[[], None]] = deque()
        context = Context()
        self._topic_channels = Topics(self, context, settings.topics, self._warn)
        self._service_calls = Services(self, settings.services, self._order, self._warn)
        publishers = ClientPublishers(self, settings.client_topics, self._warn)
        behind = hidden_address()
        self._server = start_server(
            name=name,
            host=behind,
            port=0,
            capabilities=[Capability.ClientPublish, Capability.Services],
            server_listener=Listener(self._order, self._topic_channels, publishers),
            supported_encodings=['cdr'],
            asset_handler=read_asset,
            context=context,
        )
        admission = Admission.to(settings.address, settings.origins)
        address = (settings.address, settings.port)
        try:
            self._relay = Relay(
                address,
                (behind, self._server.port),
                admission,
                settings.tls,
                limit=settings.buffer,
            )
        except OSError as error:
            self._server.stop()
            raise BridgeError(
                f'port {settings.port} of {settings.address}: {error.strerror or error}; '
                'choose another with -p port:=8766, or 0 for a free one'
            ) from None
        self.create_timer(LOOK_PERIOD, self._look)
        self._look()
        self.url = _url(settings, self._relay.port, admission.token)

    @property
    def seen_at(self) -> str:
        """Where it is, in words."""
        return f'open {self.url} in Foxglove or Lichtblick (open connection, Foxglove WebSocket)'

    def close(self) -> None:
        """Close all connections."""
        self._service_calls.close()
        self._relay.close()
        self._server.stop()

    # -- in the node's thread

    def _look(self) -> None:
        self._topic_channels.look(self.get_topic_names_and_types())
        self._service_calls.look(self._server, self.get_service_names_and_types())
        self._work()

    def _warn(self, text: str) -> None:
        self.get_logger().warning(text)
        self._server.publish_status(text, StatusLevel.Warning)

    def _work(self) -> None:
        while self._orders:
            self._orders.popleft()()

    # -- in threads of the server

    def _order(self, order: Callable[[], None]) -> None:
        self._orders.append(order)
        if self.executor is not None:
            self.executor.create_task(self._work)


def _url(settings: Settings, port: int, token: str) -> str:
    host = gethostname() if settings.address in {'0.0.0.0', '::'} else settings.address  # noqa: S104
    host = f'[{host}]' if ':' in host else host
    scheme = 'ws' if settings.tls is None else 'wss'
    return f'{scheme}://{host}:{port}' + (f'/?token={quote(token)}' if token else '')
