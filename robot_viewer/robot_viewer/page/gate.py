# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Who may open the page: this host's own pages, and from elsewhere who has the token.

viser serves whoever reaches its port, and any page that a browser of this host has open may
connect to a loopback port. So each request is looked at before viser sees it.
"""

from __future__ import annotations

from asyncio import CancelledError
from collections.abc import Awaitable, Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
import hmac
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from inspect import isawaitable
import logging
import os
from pathlib import Path
import secrets
from tempfile import NamedTemporaryFile
from typing import Any
from urllib.parse import parse_qs, urlsplit

import websockets.asyncio.server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.exceptions import InvalidMessage
from websockets.http11 import Request, Response

from ..loopback import is_loopback
from .live import LIVE_PATH
from .overlay import ANSWER_TIMEOUT, Overlay, text_response

COOKIE = 'robot_viewer_token_{}'
"""By port: a browser sends the cookies of a host to all its ports, and each page has one."""
HTTP_PORT = 80
KEPT_AS = 'robot_viewer_token'


def _is_failure(record: logging.LogRecord) -> bool:
    """Whether a record is not about a client that speaks no HTTP, or requests no GET."""
    return not (record.exc_info and isinstance(record.exc_info[1], InvalidMessage))


LOGGER = logging.getLogger(__name__)
"""What websockets logs, with a traceback each."""
LOGGER.addFilter(_is_failure)


class Gate:
    """Looks at each request before viser does.

    On loopback the Host and Origin headers have to name this host: no page of elsewhere, also
    under a name that was pointed here (DNS rebinding), moves the robot. Beyond it a token is
    needed, once in the URL and then as a cookie, and Origin has to be the page's own host. The
    token stays, so that the STOP of a page that is open works when its server was started again.

    Attributes:
        token: What a page from elsewhere needs; empty on loopback.
    """

    def __init__(self, host: str, overlay: Overlay) -> None:
        """Make a token where one is needed."""
        self._overlay = overlay
        self.token = '' if is_loopback(host) else _lasting_token()
        self._serving = False

    def answer(self, path: str, headers: Headers) -> Response | None:
        """Return why a request is refused, or what it needs first; None lets it through."""
        hosts = headers.get_all('Host')
        place = urlsplit(f'//{hosts[0]}') if len(hosts) == 1 else None
        if (
            place is None
            or place.hostname is None
            or not (self.token or is_loopback(place.hostname))
        ):
            return _refusal('the page is for this host only; open it as http://localhost')
        origins = headers.get_all('Origin')
        if origins and [urlsplit(origin).netloc for origin in origins] != hosts:
            return _refusal('another page may not use this one')
        name = COOKIE.format(place.port or HTTP_PORT)
        if not self.token or self._is_known(name, headers.get_all('Cookie')):
            return None
        given = parse_qs(urlsplit(path).query).get('token', [''])
        if not hmac.compare_digest(given[0].encode(), self.token.encode()):
            return _refusal('open the page by the URL that was printed at its start')
        # Lax: also a link of another site opens the page; its requests carry the cookie no more
        cookie = f'{name}={self.token}; HttpOnly; SameSite=Lax; Path=/'
        return text_response(HTTPStatus.SEE_OTHER, '', {'Location': '/', 'Set-Cookie': cookie})

    def _is_known(self, name: str, cookies: list[str]) -> bool:
        jar = SimpleCookie()
        try:
            for cookie in cookies:
                jar.load(cookie)
        except CookieError:
            return False
        given = jar[name].value if name in jar else ''
        return hmac.compare_digest(given.encode(), self.token.encode())

    @contextmanager
    def before(self) -> Iterator[None]:
        """Stand before the server that is started in the block.

        Raises:
            RuntimeError: None was, or not by websockets: the page would be open to everybody.
        """
        serve = websocket_server.serve

        def guarded(serve_viser: Any, *args: Any, **options: Any) -> Any:  # noqa: ANN401
            self._serving = True
            options['process_request'] = partial(self._process, options.get('process_request'))
            options['logger'] = LOGGER
            options['open_timeout'] = 2.0 * ANSWER_TIMEOUT  # or it would end before the answer
            return serve(partial(self._connected, serve_viser), *args, **options)

        websocket_server.serve = guarded  # type: ignore[assignment, misc]
        try:
            yield
        finally:
            websocket_server.serve = serve  # type: ignore[misc]
        if not self._serving:
            raise RuntimeError('the server of the page asks nobody who may open it')

    async def _connected(
        self,
        serve_viser: Callable[[ServerConnection], Awaitable[None]],
        connection: ServerConnection,
    ) -> None:
        request = connection.request
        if request is not None and request.path.partition('?')[0] == LIVE_PATH:
            await self._overlay.live.serve(connection)
        else:
            await serve_viser(connection)

    async def _process(
        self,
        next_one: Callable[..., Any] | None,
        connection: Any,  # noqa: ANN401
        request: Request,
    ) -> Response | None:
        answer = self.answer(request.path, request.headers) or await self._overlay.answer(request)
        if connection.transport.is_closing():
            raise CancelledError  # a browser that waits no more; websockets would fail to answer
        if answer is not None or next_one is None:
            return answer
        result = next_one(connection, request)
        if isawaitable(result):
            result = await result
        page: Response | None = result
        return page and self._overlay.over(page)


def _lasting_token() -> str:
    """Return the token of this user's pages, which is made once; without a home, one for now."""
    fresh = secrets.token_urlsafe(24)
    try:
        folder = Path(os.environ.get('ROS_HOME') or Path.home() / '.ros')
        folder.mkdir(parents=True, exist_ok=True)
        kept = folder / KEPT_AS
        with NamedTemporaryFile('w', dir=folder) as file:  # only its owner may read it
            file.write(fresh)
            file.flush()
            with suppress(FileExistsError):
                os.link(file.name, kept)
        return kept.read_text().strip() or fresh
    except (OSError, RuntimeError):
        return fresh


def _refusal(reason: str) -> Response:
    return text_response(HTTPStatus.FORBIDDEN, reason)
