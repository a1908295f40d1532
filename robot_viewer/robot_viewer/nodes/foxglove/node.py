# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bridge: a server of Foxglove's protocol beside the robot."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from functools import partial
from pathlib import PurePosixPath
import re
from socket import gethostname
import ssl
from urllib.parse import quote, unquote

from foxglove import Context, start_server, StatusLevel
from foxglove.websocket import Capability, ChannelView, Client, ClientChannel, ServerListener
from rclpy.node import Node
from urdf_reader import find_mesh

from node_runner import destroyed_when_refused, ParameterError, ParameterReader, refuse_misspelt

from . import BridgeError
from .relay import Admission, FOXGLOVE_ORIGINS, hidden_address, Relay, SEND_BUFFER_LIMIT
from .services import Services
from .topics import ClientPublishers, EVERYTHING, NameFilter, Topics

PORT = 8765
MESHES = re.compile(
    r'package://(?:[-\w%]+/)+[-.\w%]+\.(?:dae|fbx|glb|gltf|jpeg|jpg|mtl|obj|png|stl|tif|tiff'
    r'|urdf|webp|xacro)'
)
"""Meshes and what belongs to them, of installed packages."""
LOOK_PERIOD = 1.0
"""Time between two looks at the graph in [s]."""


class AssetError(ValueError):
    """A file that is not sent."""


def read_asset(uri: str) -> bytes:
    """Read a mesh of a package, or what belongs to one.

    Raises:
        AssetError: It is something else, or leaves its package.
        MeshFileError: There is no such package or file.
        OSError: It cannot be read.
    """
    if not MESHES.fullmatch(uri):
        raise AssetError(f'{uri} is no mesh or image of a package (package://)')
    # also as %2e%2e, which is decoded before the file is looked for
    if '..' in PurePosixPath(unquote(uri)).parts:
        raise AssetError(f'{uri} leaves its package; write it without ..')
    return find_mesh(uri).read_bytes()


def _names(read: ParameterReader, name: str, meaning: str) -> NameFilter:
    try:
        return NameFilter(read.texts(name, [EVERYTHING], f'{meaning}; regular expressions'))
    except ValueError as error:
        raise ParameterError(f'{name}: {error}') from None


def _tls(read: ParameterReader) -> ssl.SSLContext | None:
    wanted = read.flag('tls', 'encrypted (wss://)', default=False)
    certificate = read.text('certfile', '', 'X.509 certificate in PEM; needed with tls')
    key = read.text('keyfile', '', 'its key in PEM; needed with tls')
    if not wanted:
        return None
    if not certificate or not key:
        raise ParameterError('tls needs certfile and keyfile')
    context = ssl.create_default_context(ssl.Purpose.CLIENT_AUTH)
    try:
        context.load_cert_chain(certificate, key)
    except OSError as error:  # ssl.SSLError is one
        raise ParameterError(f'certfile {certificate}, keyfile {key}: {error}') from None
    return context


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
        read = ParameterReader(self)
        address = read.text('address', '127.0.0.1', 'bound to it; not loopback: with a token')
        port = read.whole('port', PORT, (0, 65535), 'of the server; 0: a free one')
        tls = _tls(read)
        origins = read.texts(
            'allowed_origins',
            list(FOXGLOVE_ORIGINS),
            'sites whose pages may connect, besides those of this host; *: all',
        )
        limit = read.whole(
            'send_buffer_limit',
            SEND_BUFFER_LIMIT,
            (1, 2**40),
            'bytes that wait for a slow client; messages of topics beyond are dropped',
        )
        topics = _names(read, 'topic_whitelist', 'topics that are shown')
        services = _names(read, 'service_whitelist', 'services that may be called')
        client_topics = _names(read, 'client_topic_whitelist', 'topics to publish to')
        refuse_misspelt(self)
        self._orders: deque[Callable[[], None]] = deque()
        context = Context()
        self._topic_channels = Topics(self, context, topics, self._warn)
        self._service_calls = Services(self, services, self._warn)
        publishers = ClientPublishers(self, client_topics, self._warn)
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
        admission = Admission.to(address, origins)
        try:
            self._relay = Relay(
                (address, port), (behind, self._server.port), admission, tls, limit=limit
            )
        except OSError as error:
            self._server.stop()
            raise BridgeError(
                f'port {port} of {address}: {error.strerror or error}; '
                'choose another with -p port:=8766, or 0 for a free one'
            ) from None
        self.create_timer(LOOK_PERIOD, self._look)
        self._look()
        host = gethostname() if address in {'0.0.0.0', '::'} else address  # noqa: S104
        host = f'[{host}]' if ':' in host else host
        token = f'/?token={quote(admission.token)}' if admission.token else ''
        self.url = f'{"ws" if tls is None else "wss"}://{host}:{self._relay.port}{token}'

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
