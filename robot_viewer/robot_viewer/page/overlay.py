# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What lies over viser's page: STOP in reach of everybody, and buttons that let go.

viser has its controls in a panel, which may be folded, scrolled or busy. STOP goes its own way: a
request of its own over HTTP, not behind whatever waits in the page's connection.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from concurrent.futures import Future
import gzip
from http import HTTPStatus
from pathlib import Path

from websockets.datastructures import Headers
from websockets.http11 import Request, Response

from ..robot_state import Stop
from .live import Live

STOP_PATH = '/stop'
STOP_HEADER = 'X-Robot-Stop'
"""What no page of another site can send without being asked."""
END = b'</body>'
ANSWER_TIMEOUT = 30.0
"""Time in [s] that a request for STOP waits for the robot, which may have a long ramp; the page
warns long before."""
NO_ANSWER = 'no answer from the robot: use the emergency stop'


class Overlay:
    """Answers requests for STOP, and adds itself to the page that viser serves.

    Attributes:
        live: Its connections with the pages.
    """

    def __init__(self, stop: Callable[[], Future[Stop]], live: Live) -> None:
        """Set what STOP does: in the server's thread, without waiting for the robot."""
        self._stop, self.live = stop, live
        self._html = Path(__file__).with_name('overlay.html').read_bytes()
        self._page = b''

    async def answer(self, request: Request) -> Response | None:
        """Return what the robot answers to a request for STOP; None for other requests."""
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

    def over(self, response: Response) -> Response:
        """Return a response with the overlay in it, if it is the page.

        Raises:
            RuntimeError: The page has no end; it would be without STOP.
        """
        if not response.headers.get('Content-Type', '').startswith('text/html'):
            return response
        packed = response.headers.get('Content-Encoding') == 'gzip'
        if not self._page:
            body = gzip.decompress(response.body) if packed else bytes(response.body)
            before, end, after = body.rpartition(END)
            if not end:
                raise RuntimeError('the page has no </body>: STOP has no place on it')
            self._page = gzip.compress(before + self._html + end + after)
        body = self._page if packed else gzip.decompress(self._page)
        headers = Headers(response.headers.raw_items())
        headers['Cache-Control'] = 'no-store'  # a page without STOP may be in a cache
        del headers['Content-Length']
        headers['Content-Length'] = str(len(body))
        return Response(response.status_code, response.reason_phrase, headers, body)


def text_response(
    status: HTTPStatus, text: str, headers: Mapping[str, str] | None = None
) -> Response:
    """Make a response of one line."""
    body = f'{text}\n'.encode()
    own = {'Content-Type': 'text/plain; charset=utf-8', 'Content-Length': str(len(body))}
    return Response(status, status.phrase, Headers({**(headers or {}), **own}), body)
