# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Who may connect to the bridge, which names match, and how bytes pass."""

from __future__ import annotations

from collections.abc import Iterator
import socket
import threading

from hypothesis import given, strategies
import pytest

from robot_viewer.nodes.foxglove.relay import Admission, FOXGLOVE_ORIGINS, hidden_address, Relay
from robot_viewer.nodes.foxglove.topics import EVERYTHING, is_hidden, NameFilter

HEAD = (
    'GET {path} HTTP/1.1\r\nHost: localhost:8765\r\nUpgrade: websocket\r\n'
    'Sec-WebSocket-Protocol: {protocol}\r\n{rest}\r\n'
)


def head(path: str = '/', protocol: str = 'foxglove.sdk.v1', **headers: str) -> bytes:
    """Make the head of a request."""
    rest = ''.join(f'{name}: {value}\r\n' for name, value in headers.items())
    return HEAD.format(path=path, protocol=protocol, rest=rest).encode()


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
    admission = Admission.to('127.0.0.1', FOXGLOVE_ORIGINS)
    assert not admission.token
    assert admission.refusal(head()) is None
    assert (admission.refusal(head(Origin=origin)) is None) == admitted


def test_a_client_of_another_sub_protocol_reads_which_ones_are_spoken() -> None:
    """One of several that it offers is enough."""
    admission = Admission.to('127.0.0.1', ())
    assert admission.refusal(head(protocol='other, foxglove.websocket.v1')) is None
    assert 'speaks foxglove.sdk.v1' in str(admission.refusal(head(protocol='foxglove.sdk.v2')))


def test_all_sites_may_be_allowed() -> None:
    """By one who wants that."""
    assert Admission.to('localhost', ['*']).refusal(head(Origin='https://a.example')) is None


@pytest.mark.parametrize('address', ['0.0.0.0', '::', '192.0.2.1', 'robot.local'])  # noqa: S104
def test_from_elsewhere_the_token_counts(address: str) -> None:
    """It is another one each time."""
    admission = Admission.to(address, FOXGLOVE_ORIGINS)
    assert admission.token != Admission.to(address, FOXGLOVE_ORIGINS).token
    assert admission.refusal(head(f'/?token={admission.token}')) is None
    for path in ('/', '/?token=', f'/?token={admission.token}x', f'/{admission.token}'):
        assert 'token' in str(admission.refusal(head(path)))
    other = head(f'/?token={admission.token}', Origin='https://evil.example')
    assert 'allowed_origins' in str(admission.refusal(other))


@given(strategies.binary(max_size=200))
def test_what_is_no_request_is_refused(data: bytes) -> None:
    """Whatever comes, nothing breaks."""
    assert Admission.to('127.0.0.1', ()).refusal(data) is not None


@pytest.mark.parametrize(
    ('patterns', 'accepted', 'refused'),
    [
        ([EVERYTHING], ['/a', '/a/b'], []),
        ([''], [], ['/a', '/']),
        (['/joint_.*', '/tf'], ['/joint_states', '/tf'], ['/tf_static', '/a/joint_states']),
    ],
)
def test_expressions_match_whole_names(
    patterns: list[str], accepted: list[str], refused: list[str]
) -> None:
    """As those of the bridge in C++ do."""
    names = NameFilter(patterns)
    assert all(names.accepts(name) for name in accepted)
    assert not any(names.accepts(name) for name in refused)


def test_what_is_no_expression_is_named() -> None:
    """With the reason."""
    with pytest.raises(ValueError, match=r"'\(' is no regular expression"):
        NameFilter(['('])


def test_hidden_names() -> None:
    """As ROS hides them."""
    assert is_hidden('/arm/_action/status')
    assert not is_hidden('/arm/joint_states')


@pytest.fixture
def echo() -> Iterator[tuple[str, int]]:
    """Serve one connection at an address that is hard to guess: send back all that comes."""
    with socket.create_server((hidden_address(), 0)) as server:

        def serve() -> None:
            connection, _ = server.accept()
            with connection:
                while data := connection.recv(4096):
                    connection.sendall(data)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield server.getsockname()
        thread.join(30.0)
        assert not thread.is_alive(), 'the connection behind was not closed'


def test_bytes_pass_both_ways_after_the_head(echo: tuple[str, int]) -> None:
    """Also those that come with it; the end of one side is that of the other."""
    relay = Relay(('127.0.0.1', 0), echo, Admission.to('127.0.0.1', ()))
    with socket.create_connection(('127.0.0.1', relay.port), 30.0) as client:
        sent = head() + b'\x81\x01x'
        client.sendall(sent)
        received = b''
        while len(received) < len(sent):
            received += client.recv(4096)
        assert received == sent
        client.shutdown(socket.SHUT_WR)
        assert client.recv(4096) == b''
    relay.close()


def test_a_slow_client_holds_few_bytes_and_gets_every_answer() -> None:
    """Messages of topics are left out while too much waits for it; what comes is whole."""
    message = b'\x82\x7f' + (100_000).to_bytes(8, 'big') + b'\x01' + bytes(99_999)
    answer = b'\x81\x05later'
    with socket.create_server((hidden_address(), 0)) as server:
        relay = Relay(
            ('127.0.0.1', 0), server.getsockname(), Admission.to('127.0.0.1', ()), limit=1_000_000
        )
        with socket.create_connection(('127.0.0.1', relay.port), 30.0) as client:
            client.sendall(head())
            inner, _ = server.accept()
            with inner:
                inner.settimeout(30.0)
                inner.sendall(b'HTTP/1.1 101 Switching Protocols\r\n\r\n')
                for _ in range(1000):  # all is taken while the client reads nothing
                    inner.sendall(message)
                inner.sendall(answer)
                received = bytearray()
                while not received.endswith(answer):
                    part = client.recv(1 << 20)
                    assert part
                    received += part
        relay.close()
    _, _, frames = bytes(received).partition(b'\r\n\r\n')
    whole, rest = divmod(len(frames) - len(answer), len(message))
    assert (rest, frames) == (0, message * whole + answer)
    assert 10 <= whole < 500


def test_a_refused_client_reads_why(echo: tuple[str, int]) -> None:
    """And reaches nothing; the relay goes on, and lets a client go when it is closed."""
    relay = Relay(('127.0.0.1', 0), echo, Admission.to('127.0.0.1', ()))
    with socket.create_connection(('127.0.0.1', relay.port), 30.0) as client:
        client.sendall(b'GET / HTTP/1.1\r\nHost: localhost\r\n\r\n')
        answer = client.makefile('rb').read()
    assert answer.startswith(b'HTTP/1.1 403 Forbidden')
    assert b'this is a WebSocket of Foxglove' in answer
    with socket.create_connection(('127.0.0.1', relay.port), 30.0) as client:
        client.sendall(head())
        assert client.recv(4096)
        relay.close()
        assert client.recv(4096) == b''
