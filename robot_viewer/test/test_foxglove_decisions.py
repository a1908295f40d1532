# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the server of the bridge to Foxglove decides alone, as who may connect."""

from __future__ import annotations

import socket
import threading

import pytest
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
