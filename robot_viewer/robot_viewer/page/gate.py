# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Access control of the page, by origin on this host and by token from others; and STOP.

viser serves every client of its port, and any page open in a browser of this host may connect to
a loopback port. So this module checks each request before viser handles it.

viser's panel may be folded, scrolled or busy. STOP therefore does not use it, but a separate HTTP
request, which does not queue behind other messages of the page.
"""

from __future__ import annotations

import asyncio
from asyncio import CancelledError
from collections.abc import Awaitable, Callable, Iterator, Mapping
from concurrent.futures import Future
from contextlib import contextmanager, suppress
from functools import partial
import gzip
import hmac
from http import HTTPStatus
from http.cookies import CookieError, SimpleCookie
from inspect import isawaitable
import ipaddress
import logging
import os
from pathlib import Path
import secrets
import socket
from tempfile import NamedTemporaryFile
from typing import Any
from urllib.parse import parse_qs, urlsplit

import websockets.asyncio.server as websocket_server
from websockets.asyncio.server import ServerConnection
from websockets.datastructures import Headers
from websockets.exceptions import InvalidMessage
from websockets.http11 import Request, Response

from ..robot_state import Stop
from . import client
from .live import Live, LIVE_PATH

LOOPBACK_NAMES = frozenset({'localhost', 'ip6-localhost', 'ip6-loopback'})
ELSEWHERE = {socket.AF_INET: '192.0.2.1', socket.AF_INET6: '2001:db8::1'}
"""Documentation addresses without a host: routes to them reveal this host's outward address."""


def is_loopback(host: str) -> bool:
    """Whether a host is reachable from this computer only."""
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return host in LOOPBACK_NAMES


def binding_problem(host: str) -> str:
    """Return why a server cannot bind to a host; empty if it can."""
    try:
        family, kind, _, _, address = socket.getaddrinfo(host, 0, type=socket.SOCK_STREAM)[0]
        with socket.socket(family, kind) as server:
            server.bind(address)
    except OSError as error:
        return error.strerror or str(error)
    except UnicodeError:
        return 'no name of a host'
    return ''


def shown_host(host: str) -> str:
    """Return the host for the URL of a server.

    For a server bound to all addresses, it is this computer's address in the network.
    """
    if host in {'localhost', '127.0.0.1'}:
        return 'localhost'
    try:
        address = ipaddress.ip_address(host)
    except ValueError:
        return host
    if address.is_unspecified:
        address = ipaddress.ip_address(_outward(address.version))
    return f'[{address}]' if address.version == 6 else str(address)


def _outward(version: int) -> str:
    family = socket.AF_INET if version == 4 else socket.AF_INET6
    with socket.socket(family, socket.SOCK_DGRAM) as probe:
        try:
            probe.connect((ELSEWHERE[family], 9))  # UDP: nothing is sent
        except OSError:  # there is no network
            return '127.0.0.1' if version == 4 else '::1'
        return str(probe.getsockname()[0])


STOP_PATH = '/stop'
STOP_HEADER = 'X-Robot-Stop'  # other sites cannot send it without a CORS preflight
END = b'</body>'
ANSWER_TIMEOUT = 30.0
"""Time in [s] that a STOP request waits for the robot, whose ramp may be long; the page warns
long before."""
NO_ANSWER = 'no answer from the robot: use the emergency stop'


def text_response(
    status: HTTPStatus, text: str, headers: Mapping[str, str] | None = None
) -> Response:
    """Return a one-line plain text response."""
    body = f'{text}\n'.encode()
    own = {'Content-Type': 'text/plain; charset=utf-8', 'Content-Length': str(len(body))}
    return Response(status, status.phrase, Headers({**(headers or {}), **own}), body)


COOKIE = 'robot_viewer_token_{}'
"""Cookie name by port: browsers send a host's cookies to all its ports, and each page has one."""
HTTP_PORT = 80
KEPT_AS = 'robot_viewer_token'


def _is_failure(record: logging.LogRecord) -> bool:
    """Return whether to log a record: not if a client only failed to send an HTTP GET."""
    return not (record.exc_info and isinstance(record.exc_info[1], InvalidMessage))


LOGGER = logging.getLogger(__name__)  # for websockets, which logs a traceback each time
LOGGER.addFilter(_is_failure)


class Gate:
    """Checks each request before viser does, answers STOP, and adds the overlay to the page.

    On loopback the Host and Origin headers must name this host, so that no page of another site
    moves the robot, even by DNS rebinding. Other addresses require a token, first in the URL, then
    as a cookie, and Origin must be the page's own host. The token is permanent, so that STOP on an
    open page still works after a restart of its server.
    """

    def __init__(self, host: str, stop: Callable[[], Future[Stop]], live: Live) -> None:
        """Create a token if one is required; ``stop`` must not wait for the robot."""
        self._stop, self._live = stop, live
        self._html = Path(__file__).with_name('overlay.html').read_bytes()
        self._page = b''  # viser's page with the overlay
        self._client_path, self._client = '', b''
        self.token = '' if is_loopback(host) else _lasting_token()
        self._serving = False

    def answer(self, path: str, headers: Headers) -> Response | None:
        """Return a refusal, or a response that must come first; None accepts the request."""
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
        # Lax: links of other sites may open the page, but their requests carry no cookie
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
        """Install this gate in front of the server that the block starts.

        Raises:
            RuntimeError: No server was started by websockets: the page would be unprotected.
        """
        serve = websocket_server.serve

        def guarded(serve_viser: Any, *args: Any, **options: Any) -> Any:  # noqa: ANN401
            self._serving = True
            options['process_request'] = partial(self._process, options.get('process_request'))
            options['logger'] = LOGGER
            options['open_timeout'] = 2.0 * ANSWER_TIMEOUT  # else it would end before the answer
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
            await self._live.serve(connection)
        else:
            await serve_viser(connection)

    async def _process(
        self,
        next_one: Callable[..., Any] | None,
        connection: Any,  # noqa: ANN401
        request: Request,
    ) -> Response | None:
        answer = self.answer(request.path, request.headers) or await self._answer_stop(request)
        if connection.transport.is_closing():
            raise CancelledError  # the browser is gone; websockets could not answer
        if answer is not None or next_one is None:
            return answer
        if self._client and request.path == self._client_path:
            return client.response(self._client)
        result = next_one(connection, request)
        if isawaitable(result):
            result = await result
        page: Response | None = result
        return page and self._over(page)

    async def _answer_stop(self, request: Request) -> Response | None:
        """Return the robot's answer to a STOP request; None for other requests."""
        if request.path.partition('?')[0] != STOP_PATH:
            return None
        if STOP_HEADER not in request.headers:
            return text_response(HTTPStatus.FORBIDDEN, f'STOP needs the header {STOP_HEADER}')
        try:
            called = asyncio.shield(asyncio.wrap_future(self._stop()))
            answer = await asyncio.wait_for(called, ANSWER_TIMEOUT)
        except TimeoutError:
            return text_response(HTTPStatus.GATEWAY_TIMEOUT, NO_ANSWER)
        status = HTTPStatus.OK if answer.stands else HTTPStatus.BAD_GATEWAY
        return text_response(status, answer.text)

    def _over(self, response: Response) -> Response:
        """Add the overlay to a response if it is the page.

        Raises:
            RuntimeError: The page has no end tag for the overlay, so it would lack STOP.
        """
        if not response.headers.get('Content-Type', '').startswith('text/html'):
            return response
        packed = response.headers.get('Content-Encoding') == 'gzip'
        if not self._page:
            body = gzip.decompress(response.body) if packed else bytes(response.body)
            before, end, after = body.rpartition(END)
            if not end:
                raise RuntimeError('the page has no </body>: STOP has no place on it')
            page, self._client_path, self._client = client.split(before + self._html + end + after)
            self._page = gzip.compress(page)
        body = self._page if packed else gzip.decompress(self._page)
        headers = Headers(response.headers.raw_items())
        headers['Cache-Control'] = 'no-store'  # a cache may hold a page without STOP
        del headers['Content-Length']
        headers['Content-Length'] = str(len(body))
        return Response(response.status_code, response.reason_phrase, headers, body)


def _lasting_token() -> str:
    """Return this user's permanent token; without a home directory a temporary one."""
    fresh = secrets.token_urlsafe(24)
    try:
        folder = Path(os.environ.get('ROS_HOME') or Path.home() / '.ros')
        folder.mkdir(parents=True, exist_ok=True)
        kept = folder / KEPT_AS
        with NamedTemporaryFile('w', dir=folder) as file:  # readable by its owner only
            file.write(fresh)
            file.flush()
            with suppress(FileExistsError):
                os.link(file.name, kept)
        return kept.read_text().strip() or fresh
    except (OSError, RuntimeError):
        return fresh


def _refusal(reason: str) -> Response:
    return text_response(HTTPStatus.FORBIDDEN, reason)
