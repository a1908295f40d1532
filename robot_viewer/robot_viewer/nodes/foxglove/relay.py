# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The port of the bridge: admits a connection, then passes its bytes on to the server behind it.

The server of foxglove-sdk admits every client. So it is bound to a loopback address that cannot be
guessed, and stands behind this. It limits the number of messages that wait for a slow client, not
their bytes: a thousand images are gigabytes. So messages of topics are dropped here while more
than a number of bytes waits for their client. Clients that know only the former sub-protocol are
served too, as its messages have the same form; all of them get the distribution of ROS.

Programs and pages of this host may connect, known pages, and from elsewhere who has the token. A
browser lets any page connect to a loopback port, and names the page's site in the header Origin,
which the page cannot change. Programs send none.
"""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from contextlib import suppress
from dataclasses import dataclass
import hmac
from http import HTTPStatus
from http.client import HTTPException, parse_headers
from io import BytesIO
import json
import os
import secrets
import ssl
import threading
from urllib.parse import parse_qs, urlsplit

from ...loopback import is_loopback

FOXGLOVE_ORIGINS = ('https://app.foxglove.dev', 'file://')
"""Foxglove in a browser, and desktop programs, whose pages are files of their own."""
ANY_ORIGIN = '*'
SUBPROTOCOL, FORMER = 'foxglove.sdk.v1', 'foxglove.websocket.v1'
"""Sub-protocols of clients of foxglove-sdk, and of those from before it."""
HEAD_TIMEOUT = 5.0
"""Time for the head of a request in [s]."""
SEND_BUFFER_LIMIT = 10_000_000
"""Bytes that may wait for a client, as of the bridge in C++."""
MAX_HEAD = 16 * 1024
"""Its greatest size in [byte]."""
CHUNK = 64 * 1024
TEXT, BINARY = 0x81, 0x82
"""First byte of a whole text frame and of a whole binary frame (RFC 6455, section 5.2)."""
MESSAGE_DATA = 0x01
"""First byte of a message of a topic (Foxglove WebSocket protocol, Message Data)."""


@dataclass(frozen=True, slots=True)
class Admission:
    """Looks at the head of each request.

    Attributes:
        origins: Sites whose pages may connect, besides those of this host; `*` for all.
        token: What a client has to have in its URL; empty where none is needed.
    """

    origins: frozenset[str]
    token: str

    @classmethod
    def to(cls, address: str, origins: Iterable[str]) -> Admission:
        """Make a token where one is needed."""
        token = '' if is_loopback(address) else secrets.token_urlsafe(24)
        return cls(frozenset(origins), token)

    def refusal(self, head: bytes) -> str | None:
        """Return why a request is refused; None when it is not."""
        line, _, rest = head.partition(b'\r\n')
        words = line.decode('latin-1').split(' ')
        try:
            headers = parse_headers(BytesIO(rest))
        except HTTPException as error:
            return f'not understood: {error}'
        if len(words) != 3 or headers.get('Upgrade', '').lower() != 'websocket':
            return 'this is a WebSocket of Foxglove; open it in Foxglove or Lichtblick'
        offered = ','.join(headers.get_all('Sec-WebSocket-Protocol', []))
        if not {SUBPROTOCOL, FORMER} & {each.strip() for each in offered.split(',')}:
            return (
                f'the client offers the sub-protocol {offered!r}; this bridge speaks {SUBPROTOCOL}'
                f' and {FORMER}'
            )
        origins = headers.get_all('Origin', [])
        if not all(self._is_known(origin) for origin in origins):
            return f'{origins[0]} is not in allowed_origins; add it, if you trust that site'
        given = parse_qs(urlsplit(words[1]).query).get('token', [''])[0]
        if not hmac.compare_digest(given.encode(), self.token.encode()) and self.token:
            return 'open it by the URL that was printed at its start, with its token'
        return None

    def _is_known(self, origin: str) -> bool:
        if origin in self.origins or ANY_ORIGIN in self.origins:
            return True
        host = urlsplit(origin).hostname
        return host is not None and is_loopback(host)


def hidden_address() -> str:
    """Return one of the 16 million addresses of the loopback interface, by chance."""
    return '127.' + '.'.join(str(1 + secrets.randbelow(254)) for _ in range(3))


class Relay:
    """Listens in a thread of its own.

    Attributes:
        port: What it is bound to.
    """

    def __init__(
        self,
        address: tuple[str, int],
        behind: tuple[str, int],
        admission: Admission,
        tls: ssl.SSLContext | None = None,
        *,
        limit: int = SEND_BUFFER_LIMIT,
    ) -> None:
        """Bind, and serve from now on.

        Args:
            address: Host and port; port 0 for a free one.
            behind: Host and port of the server behind.
            admission: Looks at each request.
            tls: Certificate and key, where connections are encrypted.
            limit: Number of bytes that may wait for a client.

        Raises:
            OSError: The address cannot be bound.
        """
        self._behind, self._admission, self._tls = behind, admission, tls
        self._limit = limit
        self._loop = asyncio.new_event_loop()
        self._connections: set[asyncio.Task[None]] = set()
        try:
            self._server = self._loop.run_until_complete(
                asyncio.start_server(self._admit, *address, ssl=tls, limit=MAX_HEAD)
            )
        except BaseException:
            self._loop.close()
            raise
        self.port: int = self._server.sockets[0].getsockname()[1]
        self._thread = threading.Thread(target=self._loop.run_forever, name='relay', daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Close the port and every connection."""
        asyncio.run_coroutine_threadsafe(self._close(), self._loop).result()
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join()
        self._loop.close()

    async def _close(self) -> None:
        self._server.close()
        for task in self._connections:
            task.cancel()
        await asyncio.gather(*self._connections, return_exceptions=True)

    async def _admit(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        task = asyncio.current_task()
        if task is None:
            return
        self._connections.add(task)
        try:
            with suppress(OSError, asyncio.TimeoutError, asyncio.IncompleteReadError):
                await self._serve(reader, writer)
        except asyncio.LimitOverrunError:
            pass  # a head that does not end
        except asyncio.CancelledError:
            pass  # the relay is being closed
        finally:
            self._connections.discard(task)
            writer.close()

    async def _serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        head = await asyncio.wait_for(reader.readuntil(b'\r\n\r\n'), HEAD_TIMEOUT)
        refusal = self._admission.refusal(head)
        if refusal is not None:
            writer.write(_forbidden(refusal))
            await writer.drain()
            return
        former = SUBPROTOCOL.encode() not in head
        theirs, ours = FORMER.encode(), SUBPROTOCOL.encode()
        inner_reader, inner_writer = await asyncio.open_connection(*self._behind)
        try:
            inner_writer.write(head.replace(theirs, ours) if former else head)
            there = asyncio.create_task(_pass(reader, inner_writer))
            answer = await inner_reader.readuntil(b'\r\n\r\n')
            writer.write(answer.replace(ours, theirs) if former else answer)
            back = asyncio.create_task(
                _pass_messages(inner_reader, writer, self._limit)
                if b' 101 ' in answer.partition(b'\r\n')[0]
                else _pass(inner_reader, writer)
            )
            try:
                await asyncio.wait((there, back), return_when=asyncio.FIRST_COMPLETED)
            finally:
                there.cancel()
                back.cancel()
                await asyncio.gather(there, back, return_exceptions=True)
        finally:
            inner_writer.close()


async def _pass(reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
    while data := await reader.read(CHUNK):
        writer.write(data)
        await writer.drain()


async def _pass_messages(
    reader: asyncio.StreamReader, writer: asyncio.StreamWriter, limit: int
) -> None:
    """Pass frames of a WebSocket on; leave messages of topics out while too many bytes wait."""
    informed = False
    while True:
        start = await reader.readexactly(2)
        size = start[1]
        if size >= 126:  # the length follows in 2 or 8 bytes
            length = await reader.readexactly(2 if size == 126 else 8)
            start, size = start + length, int.from_bytes(length, 'big')
        body = await reader.readexactly(size)
        if not informed and start[0] == TEXT:  # the first message is serverInfo
            informed, (start, body) = True, _with_distribution(start, body)
        waiting = writer.transport.get_write_buffer_size()
        of_topic = start[0] == BINARY and body[:1] == bytes([MESSAGE_DATA])
        if of_topic and waiting and waiting + size > limit:
            continue
        writer.write(start + body)
        if waiting > 2 * limit:  # of answers, none of which may be lost
            await writer.drain()


def _with_distribution(start: bytes, body: bytes) -> tuple[bytes, bytes]:
    """Add ROS_DISTRO, by which clients choose their definitions, to a text frame of serverInfo."""
    try:
        message = json.loads(body)
    except ValueError:
        return start, body
    if not isinstance(message, dict) or message.get('op') != 'serverInfo':
        return start, body
    distribution = {'ROS_DISTRO': os.environ.get('ROS_DISTRO', 'jazzy')}
    message['metadata'] = {**message.get('metadata', {}), **distribution}
    body = json.dumps(message).encode()
    size = len(body)
    length = bytes([size]) if size < 126 else bytes([126]) + size.to_bytes(2, 'big')
    return bytes([TEXT]) + length, body


def _forbidden(reason: str) -> bytes:
    status, body = HTTPStatus.FORBIDDEN, f'{reason}\n'.encode()
    head = (
        f'HTTP/1.1 {status.value} {status.phrase}\r\nContent-Type: text/plain; charset=utf-8\r\n'
        f'Content-Length: {len(body)}\r\nConnection: close\r\n\r\n'
    )
    return head.encode() + body
