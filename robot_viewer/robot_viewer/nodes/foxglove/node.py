# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bridge: a server of Foxglove's protocol beside the robot."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from socket import gethostname
import threading
from urllib.parse import quote

from foxglove import Context, Parameter, start_server, StatusLevel
from foxglove.websocket import Capability
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rosgraph_msgs.msg import Clock

from node_runner import destroyed_when_refused

from ...exceptions import BridgeError
from ...foxglove.admission import Admission
from ...foxglove.assets import Assets
from ...foxglove.relay import hidden_address, Relay
from .graph import Links, links
from .listener import Listener
from .parameters import Parameters
from .publishing import ClientPublishers
from .services import Services
from .settings import (
    ASSETS,
    CLIENT_PUBLISH,
    CONNECTION_GRAPH,
    PARAMETERS,
    PARAMETERS_SUBSCRIBE,
    read_settings,
    SERVICES,
    Settings,
)
from .topics import TopicChoice, Topics

LOOK_PERIOD = 1.0
"""Time between two looks at the graph in [s]."""


class FoxgloveBridge(Node):
    """A server of Foxglove's protocol beside the robot.

    Clients are served in threads of foxglove-sdk. What they ask for is left for the node's thread;
    only calls of services and new values of parameters wait there, each for its own client.
    """

    @destroyed_when_refused
    def __init__(self, name: str) -> None:
        """Listen.

        Args:
            name: Of the node.

        Raises:
            ParameterError: A parameter is wrong.
            BridgeError: The port is in use.
        """
        super().__init__(name)
        settings = read_settings(self)
        self._orders: deque[Callable[[], None]] = deque()
        self._watched_graph = threading.Event()
        self._links: Links | None = None
        able = settings.capabilities
        context = Context()
        choice = TopicChoice(
            settings.topics, settings.hidden, settings.best_effort, settings.depth
        )
        self._topic_channels = Topics(self, context, choice, self._warn)
        self._client_publishers = ClientPublishers(self, settings.client_topics, self._warn)
        self._service_calls = (
            Services(self, settings.services, self._order, self._warn, hidden=settings.hidden)
            if SERVICES in able
            else None
        )
        self._parameter_mirror = (
            Parameters(self, settings.parameters, self._order, self._publish_values, self._warn)
            if able & {PARAMETERS, PARAMETERS_SUBSCRIBE}
            else None
        )
        behind = hidden_address()
        self._server = start_server(
            name=name,
            host=behind,
            port=0,
            capabilities=self._capabilities(settings),
            server_listener=Listener(
                self._order,
                self._topic_channels,
                self._client_publishers,
                self._parameter_mirror,
                self._watched_graph,
            ),
            supported_encodings=['cdr'],
            asset_handler=Assets(settings.assets).read if ASSETS in able else None,
            context=context,
            message_backlog_size=settings.backlog,
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
        if self.get_parameter('use_sim_time').value:
            self.create_subscription(Clock, '/clock', self._pass_clock, qos_profile_sensor_data)
        self.create_timer(LOOK_PERIOD, self._look)
        self._look()
        self.url = _url(settings, self._relay.port, admission.token)

    @property
    def seen_at(self) -> str:
        """Where it is, in words."""
        return f'open {self.url} in Foxglove or Lichtblick (open connection, Foxglove WebSocket)'

    def close(self) -> None:
        """Let all clients go."""
        if self._service_calls is not None:
            self._service_calls.close()
        self._relay.close()
        self._server.stop()

    def _capabilities(self, settings: Settings) -> list[Capability]:
        offered = {
            CLIENT_PUBLISH: Capability.ClientPublish,
            SERVICES: Capability.Services,
            CONNECTION_GRAPH: Capability.ConnectionGraph,
        }
        able = [value for name, value in offered.items() if name in settings.capabilities]
        if self._parameter_mirror is not None:
            able.append(Capability.Parameters)
        if self.get_parameter('use_sim_time').value:
            able.append(Capability.Time)
        return able

    # -- in the node's thread

    def _look(self) -> None:
        topics = self.get_topic_names_and_types()
        self._topic_channels.look(topics)
        services = self.get_service_names_and_types()
        if self._service_calls is not None:
            self._service_calls.look(self._server, services)
        if self._parameter_mirror is not None:
            self._parameter_mirror.look(services)
        if self._watched_graph.is_set():
            found = links(self, [name for name, _ in topics])
            if found != self._links:
                self._links = found
                self._server.publish_connection_graph(found.graph())
        self._work()

    def _pass_clock(self, message: Clock) -> None:
        self._server.broadcast_time(message.clock.sec * 1_000_000_000 + message.clock.nanosec)

    def _publish_values(self, values: list[Parameter]) -> None:
        if values:
            self._server.publish_parameter_values(values)

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
