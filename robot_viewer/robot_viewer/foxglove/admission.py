# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Who may connect: programs and pages of this host, known pages, and from elsewhere the token.

A browser lets any page connect to a loopback port, and names the page's site in the header Origin,
which the page cannot change. Programs send none.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
import hmac
from http.client import HTTPException, parse_headers
from io import BytesIO
import secrets
from urllib.parse import parse_qs, urlsplit

from ..loopback import is_loopback

FOXGLOVE_ORIGINS = ('https://app.foxglove.dev', 'file://')
"""Foxglove in a browser, and desktop programs, whose pages are files of their own."""
ANY_ORIGIN = '*'
SUBPROTOCOL, FORMER = 'foxglove.sdk.v1', 'foxglove.websocket.v1'
"""Sub-protocols of clients of foxglove-sdk, and of those from before it."""


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
