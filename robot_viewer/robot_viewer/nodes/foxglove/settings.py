# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of foxglove_bridge, by the names that the bridge in C++ has for them."""

from __future__ import annotations

from dataclasses import dataclass
import ssl

from rclpy.node import Node

from node_runner import (
    declare_given,
    given_values,
    ParameterError,
    ParameterReader,
    refuse_misspelt,
)

from ...foxglove.admission import FOXGLOVE_ORIGINS
from ...foxglove.assets import MESHES
from ...foxglove.names import EVERYTHING, NameFilter, NOTHING
from ...foxglove.relay import SEND_BUFFER_LIMIT

PORT = 8765
CLIENT_PUBLISH = 'clientPublish'
SERVICES = 'services'
PARAMETERS = 'parameters'
PARAMETERS_SUBSCRIBE = 'parametersSubscribe'
CONNECTION_GRAPH = 'connectionGraph'
ASSETS = 'assets'
CAPABILITIES = (
    CLIENT_PUBLISH,
    PARAMETERS,
    PARAMETERS_SUBSCRIBE,
    SERVICES,
    CONNECTION_GRAPH,
    ASSETS,
)
WITHOUT_EFFECT = {
    'device_token': 'there is no remote access',
    'disable_load_message': 'messages are never loaned',
    'ignore_unresponsive_param_nodes': 'each node is asked once',
    'num_threads': 'the node has one thread',
    'publish_client_count': 'clients are not counted',
    'remote_access': 'there is no remote access',
    'sysinfo': 'use psutil or top',
    'sysinfo_refresh_interval': 'use psutil or top',
    'sysinfo_topic': 'use psutil or top',
    'use_compression': 'messages are sent as they are',
}
"""Parameters of the bridge in C++ that are accepted for its launch files: what to do instead."""


@dataclass(frozen=True, slots=True)
class Settings:
    """What the parameters say.

    Attributes:
        address: Host that the port is bound to.
        port: 0 for a free one.
        tls: Certificate and key; None for connections that are not encrypted.
        origins: Sites whose pages may connect, besides those of this host.
        capabilities: What clients may do.
        backlog: How many messages may wait for a slow client in the server.
        buffer: How many bytes of messages may wait for a slow client.
        topics: Which topics are shown.
        services: Which services are offered.
        parameters: Which parameters are shown, and may be set.
        client_topics: Topics to which clients may publish.
        best_effort: Topics of which messages may be lost.
        assets: Files that clients may fetch.
        hidden: Whether topics and services that ROS hides are shown.
        depth: Smallest and greatest depth of a subscription.
    """

    address: str
    port: int
    tls: ssl.SSLContext | None
    origins: list[str]
    capabilities: frozenset[str]
    backlog: int
    buffer: int
    topics: NameFilter
    services: NameFilter
    parameters: NameFilter
    client_topics: NameFilter
    best_effort: NameFilter
    assets: NameFilter
    hidden: bool
    depth: tuple[int, int]


def read_settings(node: Node) -> Settings:
    """Declare and read all parameters.

    Args:
        node: The node.

    Raises:
        ParameterError: A value is not usable, or a name is misspelt.
    """
    read = ParameterReader(node)

    def names(name: str, default: str, meaning: str) -> NameFilter:
        try:
            return NameFilter(read.texts(name, [default], f'{meaning}; regular expressions'))
        except ValueError as error:
            raise ParameterError(f'{name}: {error}') from None

    settings = Settings(
        address=read.text('address', '127.0.0.1', 'bound to it; not loopback: with a token'),
        port=read.whole('port', PORT, (0, 65535), 'of the server; 0: a free one'),
        tls=_tls(read),
        origins=read.texts(
            'allowed_origins',
            list(FOXGLOVE_ORIGINS),
            'sites whose pages may connect, besides those of this host; *: all',
        ),
        capabilities=_capabilities(read),
        backlog=read.whole(
            'message_backlog_size', 1024, (1, 2**20), 'messages that wait for a slow client'
        ),
        buffer=read.whole(
            'send_buffer_limit',
            SEND_BUFFER_LIMIT,
            (1, 2**40),
            'bytes that wait for a slow client; messages of topics beyond are dropped',
        ),
        topics=names('topic_whitelist', EVERYTHING, 'topics that are shown'),
        services=names('service_whitelist', EVERYTHING, 'services that may be called'),
        parameters=names('param_whitelist', EVERYTHING, 'parameters, as /node.parameter'),
        client_topics=names('client_topic_whitelist', EVERYTHING, 'topics to publish to'),
        best_effort=names(
            'best_effort_qos_topic_whitelist', NOTHING, 'topics to subscribe to as best effort'
        ),
        assets=names('asset_uri_allowlist', MESHES, 'URIs of files that may be fetched'),
        hidden=read.flag('include_hidden', 'also what ROS hides', default=False),
        depth=(
            read.whole('min_qos_depth', 1, (1, 2**20), 'smallest depth of a subscription'),
            read.whole('max_qos_depth', 25, (1, 2**20), 'greatest depth of a subscription'),
        ),
    )
    if settings.depth[0] > settings.depth[1]:
        raise ParameterError(f'min_qos_depth is {settings.depth[0]}, above max_qos_depth')
    given = given_values(node)
    declare_given(node, WITHOUT_EFFECT, 'without effect')
    refuse_misspelt(node)
    for name in sorted(WITHOUT_EFFECT.keys() & given.keys()):
        node.get_logger().warning(f'{name} has no effect: {WITHOUT_EFFECT[name]}')
    return settings


def _capabilities(read: ParameterReader) -> frozenset[str]:
    wanted = read.texts('capabilities', list(CAPABILITIES), 'what clients may do')
    known = {*CAPABILITIES, 'time'}  # the latter goes with use_sim_time
    for each in filter(None, wanted):
        if each not in known:
            raise ParameterError(
                f"capabilities has '{each}'; choose some of {', '.join(CAPABILITIES)}"
            )
    return frozenset(wanted)


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
