# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A client of Foxglove's protocol.

https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md has operations and binary forms.
"""

from __future__ import annotations

from collections import defaultdict, deque
from collections.abc import Callable
import itertools
import json
import socket
import struct
import time
from typing import Any

from mcap_ros2._dynamic import generate_dynamic
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

TIMEOUT = 60.0  # [s]
PROTOCOL = Subprotocol('foxglove.sdk.v1')
FORMER = Subprotocol('foxglove.websocket.v1')

Decoder = Callable[[bytes], Any]


class FoxgloveClient:
    """Connects, and keeps what the server sends.

    Attributes:
        info: The first message of the server.
        channels: Offered channels by topic.
        statuses: Texts of the server for people.
    """

    def __init__(
        self, url: str, origin: str | None = None, protocol: Subprotocol = PROTOCOL
    ) -> None:
        """Connect.

        Args:
            url: Of the server.
            origin: Site of the page, as a browser names it.
            protocol: Sub-protocol that the client speaks.
        """
        self._socket = connect(
            url,
            subprotocols=[protocol],
            origin=None if origin is None else Origin(origin),
            open_timeout=TIMEOUT,
            close_timeout=0.0,
            max_size=None,
        )
        assert self._socket.subprotocol == protocol
        self._numbers = itertools.count(1)
        self._subscribed: dict[int, str] = {}
        self._received: dict[str, deque[bytes]] = defaultdict(deque)
        self._answers: dict[int, bytes | str] = {}
        self.channels: dict[str, dict[str, Any]] = {}
        self.statuses: list[str] = []
        self.info: dict[str, Any] = {}
        self.until(lambda: bool(self.info), 'serverInfo')

    def close(self) -> None:
        """End the connection."""
        self._socket.close()

    def abort(self) -> None:
        """End it as a browser does that is killed."""
        self._socket.socket.shutdown(socket.SHUT_RDWR)

    # -- what is done

    def subscribe(self, topic: str) -> None:
        """Subscribe to a topic that is or will be offered."""
        self.until(lambda: topic in self.channels, f'channel {topic}')
        number = next(self._numbers)
        self._subscribed[number] = topic
        wanted = {'id': number, 'channelId': self.channels[topic]['id']}
        self.send('subscribe', subscriptions=[wanted])

    def next_message(self, topic: str) -> Any:
        """Return the next message of a topic, decoded by the definition that the server sent."""
        self.until(lambda: bool(self._received[topic]), f'message of {topic}')
        channel = self.channels[topic]
        assert channel['encoding'] == 'cdr'
        assert channel['schemaEncoding'] == 'ros2msg'
        return decoder(channel['schemaName'], channel['schema'])(self._received[topic].popleft())

    def fetch(self, uri: str) -> bytes | str:
        """Fetch a file; return its bytes, or the text of the failure."""
        number = next(self._numbers)
        self.send('fetchAsset', uri=uri, requestId=number)
        self.until(lambda: number in self._answers, f'file {uri}')
        return self._answers[number]

    # -- what comes

    def until(self, condition: Callable[[], bool], what: str) -> None:
        """Receive until a condition holds."""
        deadline = time.monotonic() + TIMEOUT
        while not condition():
            left = deadline - time.monotonic()
            assert left > 0.0, f'no {what}; statuses: {self.statuses}'
            try:
                data = self._socket.recv(min(left, 0.2))
            except TimeoutError:
                continue
            if isinstance(data, str):
                self._take(json.loads(data))
            else:
                self._take_binary(data)

    def _take(self, message: dict[str, Any]) -> None:
        operation = message['op']
        if operation == 'serverInfo':
            self.info = message
        elif operation == 'advertise':
            self.channels.update({each['topic']: each for each in message['channels']})
        elif operation == 'unadvertise':
            gone = set(message['channelIds'])
            self.channels = {t: c for t, c in self.channels.items() if c['id'] not in gone}
        elif operation == 'status':
            self.statuses.append(message['message'])

    def _take_binary(self, data: bytes) -> None:
        kind = data[0]
        if kind == 1:
            number, _ = struct.unpack_from('<IQ', data, 1)
            self._received[self._subscribed[number]].append(data[13:])
        elif kind == 4:
            request, status, length = struct.unpack_from('<IBI', data, 1)
            rest = data[10:]
            self._answers[request] = rest[:length].decode() if status else rest[length:]

    def send(self, operation: str, **values: object) -> None:
        """Send an operation."""
        self._socket.send(json.dumps({'op': operation, **values}))


def decoder(name: str, definition: str) -> Decoder:
    """Make a decoder of a definition."""
    found: Decoder = generate_dynamic(name, definition)[name]
    return found
