# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Who may open the page: requests as browsers send them, to the real server of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
import gzip
from http.client import HTTPConnection
from urllib.parse import urlsplit

import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from robot_viewer.page import gate as page_gate
from robot_viewer.page.gate import Gate
from robot_viewer.page.overlay import Overlay, STOP_HEADER
from robot_viewer.page.robot_page import RobotPage, Twist, Velocity

TIMEOUT = 10.0  # [s]
EVERYWHERE = '0.0.0.0'  # noqa: S104  # what is tested is that it is guarded


class Nothing:
    """Does nothing that is asked for, but to count what stops."""

    def __init__(self) -> None:
        """Begin with none."""
        self.stops = 0

    def stop(self) -> None:
        """Count it."""
        self.stops += 1

    def call(self, service: str) -> None:
        """Nothing."""

    def jog(self, twist: Twist) -> None:
        """Nothing."""

    def walk(self, velocity: Velocity) -> None:
        """Nothing."""

    def set_mode(self, mode: str) -> None:
        """Nothing."""

    def publish_joints(self, positions: Mapping[str, float]) -> None:
        """Nothing."""

    def aim(self, controller: str, targets: Mapping[str, float], share: float) -> None:
        """Nothing."""


@pytest.fixture
def actions() -> Nothing:
    """What is done on the page."""
    return Nothing()


@pytest.fixture(params=['127.0.0.1', EVERYWHERE], ids=['loopback', 'open'])
def page(request: pytest.FixtureRequest, actions: Nothing) -> Iterator[RobotPage]:
    """Serve a page."""
    made = RobotPage(request.param, 8300, actions)
    yield made
    made.close()


def get(page: RobotPage, path: str = '/', **headers: str) -> tuple[int, str, str]:
    """Request a path; return status, text and the cookie that is set."""
    port = urlsplit(page.url).port
    connection = HTTPConnection('127.0.0.1', port, timeout=TIMEOUT)
    try:
        connection.request('GET', path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.read().decode(), answer.headers.get('Set-Cookie', '')
    finally:
        connection.close()


def cookie_of(page: RobotPage) -> dict[str, str]:
    """Return the header of a browser that has opened the printed URL."""
    query = urlsplit(page.url).query
    if not query:
        return {}
    status, _, cookie = get(page, f'/?{query}')
    assert status == 303
    return {'Cookie': cookie.partition(';')[0]}


def test_the_printed_url_opens_the_page(page: RobotPage) -> None:
    """And what it loads afterwards."""
    status, text, _ = get(page, **cookie_of(page))
    assert status == 200
    assert '<html' in text
    assert 'robot-stop' in text


def test_stop_is_for_those_who_may_open_the_page(page: RobotPage, actions: Nothing) -> None:
    """Only by a request that no other site can send; nobody else learns that it is there."""
    cookie, header = cookie_of(page), {STOP_HEADER: '1'}
    assert get(page, '/stop', **cookie)[0] == 403
    assert get(page, '/stop', Host='evil.example', **header)[0] == 403
    assert get(page, '/stop', Origin='http://evil.example', **cookie, **header)[0] == 403
    if cookie:
        assert get(page, '/stop', **header)[0] == 403
    assert actions.stops == 0
    assert get(page, '/stop', **cookie, **header)[0] == 200
    assert actions.stops == 1


@pytest.mark.parametrize('page', ['127.0.0.1'], indirect=True)
def test_the_page_has_stop_whether_it_is_packed_or_not(page: RobotPage) -> None:
    """Browsers take it packed; and none keeps a page of another version."""
    connection = HTTPConnection('127.0.0.1', urlsplit(page.url).port, timeout=TIMEOUT)
    try:
        connection.request('GET', '/', headers={'Accept-Encoding': 'gzip'})
        answer = connection.getresponse()
        assert answer.headers['Cache-Control'] == 'no-store'
        assert answer.headers['Content-Encoding'] == 'gzip'
        assert gzip.decompress(answer.read()).decode() == get(page)[1]
    finally:
        connection.close()


@pytest.mark.parametrize('page', [EVERYWHERE], indirect=True)
@pytest.mark.parametrize('query', ['', '?token=', '?token=x', '?other=1'])
def test_a_page_that_is_open_to_others_needs_its_token(page: RobotPage, query: str) -> None:
    """In the URL; a wrong cookie is none."""
    status, text, cookie = get(page, f'/{query}', Cookie=f'{page_gate.COOKIE}=wrong')
    assert (status, cookie) == (403, '')
    assert 'by the URL that was printed' in text


@pytest.mark.parametrize('page', ['127.0.0.1'], indirect=True)
def test_a_name_that_was_pointed_to_this_host_opens_nothing(page: RobotPage) -> None:
    """DNS rebinding: the browser takes the page for one of elsewhere."""
    status, text, _ = get(page, Host=f'evil.example:{urlsplit(page.url).port}')
    assert status == 403
    assert 'for this host only' in text


@pytest.mark.parametrize('origin', ['http://evil.example', 'http://localhost:1', 'null'])
def test_another_page_gets_no_connection(page: RobotPage, origin: str) -> None:
    """Any page of a browser of this host may try, with the cookies of ours."""
    cookie, port = cookie_of(page), urlsplit(page.url).port
    address = f'127.0.0.1:{port}'

    def try_it(from_page: str) -> None:
        connect(
            f'ws://{address}',
            origin=Origin(from_page),
            additional_headers=cookie,
            subprotocols=[Subprotocol('viser-v1.1.1')],
        ).close()

    with pytest.raises(InvalidStatus, match='403'):
        try_it(origin)
    try_it(f'http://{address}')


def test_a_server_that_is_not_guarded_is_none() -> None:
    """A version of viser that serves otherwise must not open the page to everybody."""
    with (
        pytest.raises(RuntimeError, match='asks nobody'),
        Gate('127.0.0.1', Overlay(Nothing().stop)).before(),
    ):
        pass
