# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of foxglove_bridge, by the names that the bridge in C++ has for them."""

from __future__ import annotations

from dataclasses import dataclass
import ssl

from rclpy.node import Node

from node_runner import ParameterError, ParameterReader, refuse_misspelt

from ...foxglove.admission import FOXGLOVE_ORIGINS
from ...foxglove.names import EVERYTHING, NameFilter
from ...foxglove.relay import SEND_BUFFER_LIMIT

PORT = 8765


@dataclass(frozen=True, slots=True)
class Settings:
    """What the parameters say.

    Attributes:
        address: Host that the port is bound to.
        port: 0 for a free one.
        tls: Certificate and key; None for connections that are not encrypted.
        origins: Sites whose pages may connect, besides those of this host.
        buffer: How many bytes of messages may wait for a slow client.
        topics: Which topics are shown.
        services: Which services are offered.
        client_topics: Topics to which clients may publish.
    """

    address: str
    port: int
    tls: ssl.SSLContext | None
    origins: list[str]
    buffer: int
    topics: NameFilter
    services: NameFilter
    client_topics: NameFilter


def read_settings(node: Node) -> Settings:
    """Declare and read all parameters.

    Raises:
        ParameterError: A value is not usable, or a name is misspelt.
    """
    read = ParameterReader(node)

    def names(name: str, meaning: str) -> NameFilter:
        try:
            return NameFilter(read.texts(name, [EVERYTHING], f'{meaning}; regular expressions'))
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
        buffer=read.whole(
            'send_buffer_limit',
            SEND_BUFFER_LIMIT,
            (1, 2**40),
            'bytes that wait for a slow client; messages of topics beyond are dropped',
        ),
        topics=names('topic_whitelist', 'topics that are shown'),
        services=names('service_whitelist', 'services that may be called'),
        client_topics=names('client_topic_whitelist', 'topics to publish to'),
    )
    refuse_misspelt(node)
    return settings


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
