# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run robot_viewer foxglove_bridge``: serves ROS topics to Foxglove and Lichtblick.

Read-only server of https://github.com/foxglove/ws-protocol: clients cannot move the robot.
"""

from __future__ import annotations

import asyncio
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
import hmac
from http import HTTPStatus
from importlib import import_module
import itertools
import json
import os
from pathlib import PurePosixPath
import re
import secrets
import struct
import threading
from typing import Any
from urllib.parse import parse_qs, unquote, urlsplit

from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from rclpy.subscription import Subscription
from urdf_reader import find_mesh
from websockets.asyncio.server import broadcast, ServerConnection
from websockets.asyncio.server import serve as serve_websocket
from websockets.asyncio.server import Server as WebSocketServer
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response
from websockets.typing import Subprotocol

from message_definitions import DefinitionError, message_definition
from node_runner import (
    destroyed_when_refused,
    ParameterError,
    ParameterReader,
    refuse_misspelt,
    run_program,
)

from ..page.gate import is_loopback, shown_host
from .interfaces import serve

NAME = 'foxglove_bridge'
NICENESS = 10  # a viewer must not delay a control loop
PORT = 8765
PROTOCOLS = [Subprotocol('foxglove.sdk.v1'), Subprotocol('foxglove.websocket.v1')]
"""Current clients, and those before foxglove-sdk; the server uses their common subset only."""
FOXGLOVE_ORIGINS = ('https://app.foxglove.dev', 'file://')
"""Foxglove in a browser, and desktop programs, which load their pages from files."""
MESHES = re.compile(
    r'package://(?:[-\w%]+/)+[-.\w%]+\.(?:dae|fbx|glb|gltf|jpeg|jpg|mtl|obj|png|stl|tif|tiff'
    r'|urdf|webp|xacro)'
)
"""Meshes of installed packages, and files that meshes refer to."""
MESSAGE_DATA, ASSET = 1, 4
"""First byte of a topic message, and of a file response."""
WAITING = 10_000_000
"""Send buffer limit per client in [byte]; a slow client misses topic messages beyond it."""
LOOK_PERIOD = 1.0  # time between two scans of the ROS graph in [s]
UNKNOWN_DEPTH, MAX_DEPTH = 10, 25
"""Assumed depth of a publisher whose depth DDS does not report, and the maximum depth of a
subscription."""
WARNING, ERROR = 1, 2  # status levels of the protocol
QUOTED = 80  # maximum length of an invalid text quoted in an error
ID_END = 2**32  # exclusive maximum of ids that clients choose; sent as uint32
CLOSE_TIMEOUT = 1.0  # time for a client to acknowledge the close in [s]


@dataclass(frozen=True, slots=True)
class Admission:
    """Decides who may connect.

    A browser lets any page connect to a port of this computer, and sends the page's site in the
    Origin header, which the page cannot change. Other programs send no Origin.
    """

    origins: frozenset[str]
    """Sites whose pages may connect in addition to this host's; `*` for all."""
    token: str  # required in the client's URL; empty if not required

    def refusal(self, path: str, origins: Sequence[str]) -> str:
        """Return why a request is refused; empty if it is accepted."""
        for origin in origins:
            host = urlsplit(origin).hostname
            local = host is not None and is_loopback(host)
            if not (local or {origin, '*'} & self.origins):
                return f'{origin} is not in allowed_origins; add it, if you trust that site'
        given = parse_qs(urlsplit(path).query).get('token', [''])[0]
        if not hmac.compare_digest(given.encode(), self.token.encode()) and self.token:
            return 'open it by the URL that was printed at its start, with its token'
        return ''


@dataclass(eq=False, slots=True)
class _Channel:
    """A topic advertised to clients."""

    type: str
    kind: Any  # class of its messages
    offer: dict[str, object]  # its advertisement
    subscription: Subscription | None = None  # exists while a client subscribes
    qos: QoSProfile | None = None  # of the subscription


class Server:
    """WebSocket server in its own thread; calls ``wanted`` with a newly subscribed topic or ''."""

    def __init__(
        self, address: tuple[str, int], admission: Admission, wanted: Callable[[str], None]
    ) -> None:
        """Start listening; port 0 selects a free one.

        Raises:
            OSError: The address cannot be bound.
        """
        self._admission, self._wanted = admission, wanted
        # topics of each client by the subscription ids that it chose
        self._clients: dict[ServerConnection, dict[int, str]] = {}
        self._offers: dict[str, dict[str, object]] = {}
        self._loop = asyncio.new_event_loop()
        try:
            self._server = self._loop.run_until_complete(self._listen(*address))
        except BaseException:
            self._loop.close()
            raise
        self.port: int = next(iter(self._server.sockets)).getsockname()[1]
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()

    async def _listen(self, host: str, port: int) -> WebSocketServer:
        return await serve_websocket(
            self._serve,
            host,
            port,
            subprotocols=PROTOCOLS,
            process_request=self._admit,
            compression=None,
            close_timeout=CLOSE_TIMEOUT,
        )

    # -- in any thread

    @property
    def wanted(self) -> frozenset[str]:
        """Topics with at least one subscribed client."""
        clients = tuple(self._clients.values())
        return frozenset(topic for topics in clients for topic in tuple(topics.values()))

    def post(self, act: Callable[..., None], *values: object) -> None:
        """Call a function in the server's thread."""
        self._loop.call_soon_threadsafe(act, *values)

    def close(self) -> None:
        """Close the port and every connection."""

        async def close() -> None:
            self._server.close()
            await self._server.wait_closed()

        asyncio.run_coroutine_threadsafe(close(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    # -- in its thread

    def _admit(self, connection: ServerConnection, request: Request) -> Response | None:
        refusal = self._admission.refusal(request.path, request.headers.get_all('Origin'))
        return connection.respond(HTTPStatus.FORBIDDEN, f'{refusal}\n') if refusal else None

    def publish(self, operation: str, values: dict[str, object]) -> None:
        """Send a protocol operation to all clients."""
        broadcast(self._clients, json.dumps({'op': operation, **values}))

    def offer(self, topic: str, offer: dict[str, object]) -> None:
        """Advertise a topic to all present and future clients."""
        self._offers[topic] = offer
        self.publish('advertise', {'channels': [offer]})

    def withdraw(self, topic: str) -> None:
        """Stop advertising a topic."""
        for client, topics in self._clients.items():
            self._clients[client] = {n: each for n, each in topics.items() if each != topic}
        self.publish('unadvertise', {'channelIds': [self._offers.pop(topic)['id']]})

    def send(self, topic: str, stamp: int, data: bytes) -> None:
        """Send a message to subscribed clients; ``stamp`` is its receive time in [ns]."""
        for client, topics in self._clients.items():
            if client.transport.get_write_buffer_size() > WAITING:
                continue
            for number, wanted in topics.items():
                if wanted == topic:
                    broadcast([client], struct.pack('<BIQ', MESSAGE_DATA, number, stamp) + data)

    async def _serve(self, connection: ServerConnection) -> None:
        info = {
            'op': 'serverInfo',
            'name': NAME,
            'capabilities': ['assets'],
            'metadata': {'ROS_DISTRO': os.environ.get('ROS_DISTRO', 'jazzy')},
        }
        self._clients[connection] = {}
        channels = list(self._offers.values())
        broadcast([connection], json.dumps(info))
        broadcast([connection], json.dumps({'op': 'advertise', 'channels': channels}))
        try:
            async for text in connection:
                try:
                    await self._take(connection, json.loads(text))
                except (KeyError, TypeError, ValueError) as error:
                    why = f'{type(error).__name__}: {error}'
                    _refuse(connection, f'not understood: {text[:QUOTED]!r} ({why})')
        except ConnectionClosed:
            pass
        finally:
            self._clients.pop(connection, None)
            self._wanted('')

    async def _take(self, client: ServerConnection, message: dict[str, Any]) -> None:
        match message['op']:
            case 'subscribe':
                topics = {offer['id']: topic for topic, offer in self._offers.items()}
                for each in message['subscriptions']:
                    topic = topics.get(each['channelId'], '')
                    if topic and _accepts(client, 'subscription', each['id']):
                        self._clients[client][each['id']] = topic
                        self._wanted(topic)
            case 'unsubscribe':
                for number in message['subscriptionIds']:
                    self._clients[client].pop(number, None)
                self._wanted('')
            case 'fetchAsset':
                request, uri = message['requestId'], message['uri']
                if _accepts(client, 'request', request):
                    await client.send(await asyncio.to_thread(_asset, request, uri))


def _accepts(client: ServerConnection, what: str, number: object) -> bool:
    """Return whether an id fits the protocol; send the client an error if not."""
    fits = type(number) is int and 0 <= number < ID_END
    if not fits:
        _refuse(client, f'{what} {number!r}: give it a whole number from 0 to {ID_END - 1}')
    return fits


def _refuse(client: ServerConnection, text: str) -> None:
    broadcast([client], json.dumps({'op': 'status', 'level': ERROR, 'message': text}))


def _asset(request: int, uri: str) -> bytes:
    """Return the response to an asset request: a mesh or related file, or an error."""
    data, failure = b'', b''
    if not MESHES.fullmatch(uri):
        failure = f'{uri} is no mesh or image of a package (package://)'.encode()
    # also as %2e%2e, which is decoded before the file lookup
    elif '..' in PurePosixPath(unquote(uri)).parts:
        failure = f'{uri} leaves its package; write it without ..'.encode()
    else:
        try:
            data = find_mesh(uri).read_bytes()
        except (OSError, ValueError) as error:
            failure = str(error).encode()
    return struct.pack('<BIBI', ASSET, request, bool(failure), len(failure)) + failure + data


class FoxgloveBridge(Node):
    """Advertises all topics, and subscribes to those that a client requests."""

    @destroyed_when_refused
    def __init__(self) -> None:
        """Start the server.

        Raises:
            ParameterError: A parameter is wrong, or the port is in use.
        """
        super().__init__(NAME)
        read = ParameterReader(self)
        address = read.text('address', '127.0.0.1', 'bound to it; not loopback: with a token')
        port = read.whole('port', PORT, (0, 65535), 'of the server; 0: a free one')
        origins = read.texts(
            'allowed_origins',
            list(FOXGLOVE_ORIGINS),
            'sites whose pages may connect, besides those of this host; *: all',
        )
        refuse_misspelt(self)
        self._channels: dict[str, _Channel] = {}
        self._refused: set[tuple[str, str]] = set()
        self._numbers = itertools.count(1)
        self._fresh: deque[str] = deque()
        token = '' if is_loopback(address) else secrets.token_urlsafe(24)
        admission = Admission(frozenset(origins), token)
        try:
            self._server = Server((address, port), admission, self._want)
        except OSError as error:
            raise ParameterError(
                f'port {port} of {address}: {error.strerror or error}; '
                'choose another with -p port:=8766, or 0 for a free one'
            ) from None
        self.create_timer(LOOK_PERIOD, self._look)
        self._look()
        url = f'ws://{shown_host(address)}:{self._server.port}' + (token and f'/?token={token}')
        self.seen_at = (
            f'open {url} in Foxglove or Lichtblick (open connection, Foxglove WebSocket)'
        )

    def close(self) -> None:
        """Close all connections."""
        self._server.close()

    def _want(self, topic: str) -> None:
        """Queue an update of the subscriptions; called in the server's thread."""
        self._fresh.append(topic)
        if self.executor is not None:
            self.executor.create_task(self._match)

    def _look(self) -> None:
        """Advertise new topics, and withdraw those that are gone."""
        there = {
            name: types[0]
            for name, types in self.get_topic_names_and_types()
            if not any(part.startswith('_') for part in name.split('/'))  # hidden, in ROS
        }
        for name, channel in list(self._channels.items()):
            if there.get(name) != channel.type:
                self._unsubscribe(self._channels.pop(name))
                self._server.post(self._server.withdraw, name)
        for name, type_ in there.items():
            if name not in self._channels and (name, type_) not in self._refused:
                self._offer(name, type_)
        self._match()

    def _offer(self, name: str, type_: str) -> None:
        try:
            kind, definition = class_of(type_), message_definition(type_)
        except (DefinitionError, LookupError) as error:
            self._refused.add((name, type_))
            text = f'{name} is not shown: {error}'
            self.get_logger().warning(text)
            status = {'level': WARNING, 'message': text}
            self._server.post(self._server.publish, 'status', status)
            return
        offer: dict[str, object] = {
            'id': next(self._numbers),
            'topic': name,
            'encoding': 'cdr',
            'schemaName': type_,
            'schema': definition,
            'schemaEncoding': 'ros2msg',
        }
        self._channels[name] = _Channel(type_, kind, offer)
        self._server.post(self._server.offer, name, offer)

    def _match(self) -> None:
        """Update subscriptions; resubscribe to latched topics for new clients."""
        while self._fresh:
            channel = self._channels.get(self._fresh.popleft())
            qos = None if channel is None else channel.qos
            if channel and qos and qos.durability == DurabilityPolicy.TRANSIENT_LOCAL:
                self._unsubscribe(channel)
        wanted = self._server.wanted
        for name, offered in self._channels.items():
            if name not in wanted:
                self._unsubscribe(offered)
            elif offered.qos != (qos := self._qos(name)):
                self._unsubscribe(offered)
                take = partial(self._pass, name)
                offered.qos = qos
                offered.subscription = self.create_subscription(
                    offered.kind, name, take, qos, raw=True
                )

    def _unsubscribe(self, channel: _Channel) -> None:
        if channel.subscription is not None:
            self.destroy_subscription(channel.subscription)
            channel.subscription = channel.qos = None

    def _pass(self, topic: str, data: bytes) -> None:
        stamp = self.get_clock().now().nanoseconds
        self._server.post(self._server.send, topic, stamp, data)

    def _qos(self, name: str) -> QoSProfile:
        """Return a QoS compatible with all publishers; transient local if all of them are."""
        offers = [each.qos_profile for each in self.get_publishers_info_by_topic(name)]
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


def class_of(name: str) -> Any:  # noqa: ANN401  # message types have no type
    """Return the message class of a type name such as `package/msg/Name`.

    Raises:
        LookupError: The message type is not installed.
    """
    try:
        package, folder, base = name.split('/')
        return getattr(import_module(f'{package}.{folder}'), base)
    except (AttributeError, ImportError, ValueError):
        raise LookupError(f'type {name} is not installed') from None


def main() -> int:
    """Run until Ctrl-C; return 0, or 1 if it could not start."""
    return run_program(NAME, _serve)


def _serve(stop: threading.Event) -> None:
    os.setpriority(os.PRIO_PROCESS, 0, max(NICENESS, os.getpriority(os.PRIO_PROCESS, 0)))
    node = FoxgloveBridge()
    serve(node, node.seen_at, node.close, stop)
