# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the server of the bridge to Foxglove decides alone, as who may connect."""

from __future__ import annotations

import queue
import socket
import threading

from foxglove_client import FoxgloveClient
import pytest
from rclpy.serialization import serialize_message
from std_msgs.msg import String
from websockets.client import ClientProtocol
from websockets.uri import parse_uri

from robot_viewer.nodes.foxglove_bridge import Admission, FOXGLOVE_ORIGINS, PROTOCOLS, Server

ANYWHERE = frozenset({'*'})
FOXGLOVE = frozenset(FOXGLOVE_ORIGINS)


@pytest.mark.parametrize(
    ('origin', 'admitted'),
    [
        ('https://app.foxglove.dev', True),
        ('file://', True),
        ('http://localhost:8080', True),
        ('http://[::1]:8080', True),
        ('https://app.foxglove.dev.evil.example', False),
        ('http://localhost.evil.example', False),
        ('https://evil.example', False),
        ('null', False),
        ('', False),
    ],
)
def test_sites_on_loopback(origin: str, admitted: bool) -> None:
    """A page cannot change its Origin; a program sends none."""
    admission = Admission(FOXGLOVE, '')
    assert not admission.refusal('/', [])
    assert bool(admission.refusal('/', [origin])) != admitted
    assert not Admission(ANYWHERE, '').refusal('/', [origin])


def test_from_elsewhere_the_token_counts() -> None:
    """Whatever the site is."""
    admission = Admission(FOXGLOVE, 'secret')
    assert not admission.refusal('/?token=secret', [])
    for path in ('/', '/?token=', '/?token=secretx', '/secret', '/?token=s\u00e9cret'):
        assert 'token' in admission.refusal(path, [])
    assert 'allowed_origins' in admission.refusal('/?token=secret', ['https://evil.example'])


def test_a_topic_that_is_offered_anew_is_subscribed_to_anew() -> None:
    """A subscription ends with its channel: each message comes once, and under a number of now."""
    taken = queue.SimpleQueue[str]()
    server = Server(('127.0.0.1', 0), Admission(FOXGLOVE, ''), taken.put)
    client = FoxgloveClient(f'ws://127.0.0.1:{server.port}')
    try:
        for number in (1, 2):
            string = {'schemaName': 'std_msgs/msg/String', 'schema': 'string data'}
            form = {'encoding': 'cdr', 'schemaEncoding': 'ros2msg', **string}
            server.offer('/a', {'id': number, 'topic': '/a', **form})
            client.subscribe('/a')
            assert taken.get(timeout=60.0) == '/a'
            for text in ('first', 'second'):
                server.send('/a', 0, serialize_message(String(data=text)))
            assert [client.next_message('/a').data for _ in range(2)] == ['first', 'second']
            server.withdraw('/a')
            client.until(lambda: '/a' not in client.channels, 'its end')
            assert not server.wanted
    finally:
        client.close()
        server.close()


def test_a_client_that_does_not_answer_is_not_waited_for() -> None:
    """As one on a computer that sleeps: it holds up no end of the bridge."""
    server = Server(('127.0.0.1', 0), Admission(FOXGLOVE, ''), lambda _: None)
    protocol = ClientProtocol(parse_uri(f'ws://127.0.0.1:{server.port}'), subprotocols=PROTOCOLS)
    protocol.send_request(protocol.connect())
    with socket.create_connection(('127.0.0.1', server.port), timeout=60.0) as silent:
        silent.sendall(b''.join(protocol.data_to_send()))
        assert silent.recv(1000).startswith(b'HTTP/1.1 101')
        ending = threading.Thread(target=server.close, daemon=True)
        ending.start()
        ending.join(5.0)
        assert not ending.is_alive()
