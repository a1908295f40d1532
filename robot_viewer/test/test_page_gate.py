# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Who may open the page, by requests as browsers send them; and who holds a button of it."""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import closing, suppress
import gzip
from http import HTTPStatus
from http.client import BadStatusLine, HTTPConnection
from pathlib import Path
import re
from typing import Any, cast
from urllib.parse import urlsplit

from hypothesis import given
from hypothesis import strategies as st
import pytest
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from robot_viewer.page import client, gate
from robot_viewer.page.gate import binding_problem, COOKIE, Gate, STOP_HEADER
from robot_viewer.page.jog_panel import Actions
from robot_viewer.page.live import Deadman, HEARTBEAT, Live, LIVE_PATH, RELEASED_AFTER
from robot_viewer.page.robot_page import RobotPage
from robot_viewer.robot_state import Stop


@given(st.integers(2, 200), st.floats(0.0, 60.0))
def test_what_was_held_up_counts_once(count: int, delay: float) -> None:
    """A slow connection delivers it at once, when the button may be up already."""
    deadman = Deadman()
    assert deadman.beat(1, 'hold', 10.0)
    arrivals = [10.0 + HEARTBEAT + delay + number * 1e-4 for number in range(count)]
    assert sum(deadman.beat(1, 'hold', arrival) for arrival in arrivals) == 1


@given(st.lists(st.tuples(st.integers(1, 3), st.floats(0.0, 1.0), st.booleans()), max_size=60))
def test_one_page_at_a_time(steps: list[tuple[int, float, bool]]) -> None:
    """The first that holds has control; another takes it, while nothing is held."""
    deadman, now, holder, last = Deadman(), 10.0, 0, -1.0
    for number, (page, gap, takes) in enumerate(steps):
        now += gap
        button = 'hold' if page == holder else number  # one that was refused is pressed anew
        if takes:
            holder = page if now - last >= RELEASED_AFTER else holder
            assert deadman.take(page, now) is (holder == page)
        elif deadman.beat(page, button, now):
            assert page == (holder or page)
            holder = page
        if not takes and page == holder:
            last = now
        assert deadman.holder == (holder or None)


@given(
    st.integers(1, 90),
    st.lists(st.tuples(st.sampled_from([1, 2]), st.floats(HEARTBEAT, 9.0)), max_size=60),
)
def test_after_a_stop_a_button_has_to_be_pressed_anew(
    before: int, beats: list[tuple[int, float]]
) -> None:
    """Whatever the pauses of its heartbeats, which a stalled page makes, too."""
    deadman, now = Deadman(), 10.0
    for _ in range(before):
        now += HEARTBEAT
        deadman.beat(1, 'hold', now)
        deadman.beat(2, 'hold', now)
    deadman.stop()
    for page, gap in beats:
        now += gap
        assert not deadman.beat(page, 'hold', now)
    assert deadman.release(1, 'hold', now)
    assert not deadman.release(2, 'hold', now)
    assert deadman.beat(1, 'hold', now + RELEASED_AFTER)
    assert not deadman.beat(2, 'hold', now + RELEASED_AFTER)


@pytest.mark.parametrize(
    'steps',
    [
        # each heartbeat, as the browser's timer makes them
        [('beat', 1, 'hold', HEARTBEAT, True)] * 50,
        # a page that is closed has no control; what was refused waits under a finger
        [
            ('beat', 1, 'hold', 1.0, True),
            ('beat', 2, 'hold', 1.0, False),
            ('leave', 1),
            ('beat', 2, 'hold', 1.0, False),
            ('release', 2, 'hold', 1.0),
            ('beat', 2, 'hold', 1.0, True),
        ],
        # a press that may not move anything is made anew: its reason may end while it is held
        [
            ('bar', 1, 'hold'),
            ('beat', 1, 'hold', 1.0, False),
            ('release', 1, 'hold', 1.0),
            ('beat', 1, 'hold', 1.0, True),
        ],
        # one that was let go before a stop counts at once; what is late of it does not
        [
            ('beat', 1, 'hold', 1.0, True),
            ('release', 1, 'hold', 1.0),
            ('beat', 1, 'hold', 0.1 * HEARTBEAT, False),
            ('stop',),
            ('beat', 1, 'hold', 1.0, True),
        ],
        # one that was taken off the page, and let go by nobody, bars none that comes in its place
        [
            ('beat', 1, 'hold', 1.0, True),
            ('stop',),
            ('beat', 1, 'hold', 1.0, False),
            ('beat', 1, 'its successor', 1.0, True),
        ],
        # one whose work has ended is held no more
        [
            ('beat', 1, 'hold', 1.0, True),
            ('end', 'another'),
            ('held', 0.1, True),
            ('end', 'hold'),
            ('held', 0.0, False),
            ('beat', 1, 'hold', 1.0, False),
            ('release', 1, 'hold', 1.0),
            ('beat', 1, 'hold', 1.0, True),
        ],
    ],
)
def test_which_heartbeats_count(steps: list[tuple[Any, ...]]) -> None:
    """Each step is a call, with the time since the last one in [s], and what it returns."""
    deadman, now = Deadman(), 10.0
    for name, *values in steps:
        expected = values.pop() if name in {'beat', 'held'} else None
        if name in {'beat', 'held', 'release'}:
            now += values.pop()
            values.append(now)
        answer = getattr(deadman, name)(*values)
        assert expected in {None, answer}, (name, values)


TIMEOUT = 10.0  # [s]
EVERYWHERE = '0.0.0.0'  # noqa: S104  # what is tested is that it is guarded


class Nothing:
    """Counts what stops; nothing else is asked for."""

    def __init__(self) -> None:
        self.stops = 0
        self.answer: Stop | None = Stop(stands=True, text='stopped: all')

    def stop(self) -> Future[Stop]:
        """Count it; with no answer, the future stays as it is."""
        self.stops += 1
        future: Future[Stop] = Future()
        if self.answer is not None:
            future.set_result(self.answer)
        return future


@pytest.fixture
def actions() -> Nothing:
    """What is done on the page."""
    return Nothing()


@pytest.fixture(autouse=True)
def ros_home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Keep the token of this test's pages."""
    monkeypatch.setenv('ROS_HOME', str(tmp_path))


@pytest.fixture(params=['127.0.0.1', EVERYWHERE], ids=['loopback', 'open'])
def page(request: pytest.FixtureRequest, actions: Nothing) -> Iterator[RobotPage]:
    """Serve a page."""
    made = RobotPage(request.param, 8300, cast(Actions, actions))
    yield made
    made.close()


def get(page: RobotPage, path: str = '/', **headers: str) -> tuple[int, str, str]:
    """Request a path; return status, text and the cookie that is set."""
    place = urlsplit(page.url)
    connection = HTTPConnection(place.hostname or '', place.port, timeout=TIMEOUT)
    try:
        connection.request('GET', path, headers=headers)
        answer = connection.getresponse()
        return answer.status, answer.read().decode(), answer.headers.get('Set-Cookie', '')
    finally:
        connection.close()


def test_a_request_that_is_no_get_leaves_no_traceback(
    page: RobotPage, caplog: pytest.LogCaptureFixture
) -> None:
    """Websockets reads no other one: it would log an error for each."""
    place = urlsplit(page.url)
    with closing(HTTPConnection(place.hostname or '', place.port, timeout=TIMEOUT)) as connection:
        connection.request('POST', '/stop')
        with suppress(BadStatusLine, ConnectionError):
            assert connection.getresponse().status >= HTTPStatus.BAD_REQUEST
    assert get(page)[0]  # it is served after that
    assert not [each for each in caplog.records if each.exc_info]


def cookie_of(page: RobotPage) -> dict[str, str]:
    """Return the header of a browser that has opened the printed URL."""
    query = urlsplit(page.url).query
    if not query:
        return {}
    status, _, cookie = get(page, f'/?{query}')
    # a link of another site opens the page; requests that it makes itself have no cookie
    assert (status, 'SameSite=Lax' in cookie) == (303, True)
    return {'Cookie': cookie.partition(';')[0]}


def test_stop_is_for_those_who_may_open_the_page(page: RobotPage, actions: Nothing) -> None:
    """Only by a request that no other site can send; nobody else learns that it is there."""
    cookie, header = cookie_of(page), {STOP_HEADER: '1'}
    assert get(page, '/stop', **cookie)[0] == 403
    assert get(page, '/stop', Host='evil.example', **header)[0] == 403
    assert get(page, '/stop', Origin='http://evil.example', **cookie, **header)[0] == 403
    if cookie:
        assert get(page, '/stop', **header)[0] == 403
    assert actions.stops == 0
    assert get(page, '/stop', **cookie, **header)[:2] == (200, 'stopped: all\n')
    assert actions.stops == 1


@pytest.mark.parametrize('page', ['127.0.0.1'], indirect=True)
@pytest.mark.parametrize(
    ('answer', 'expected'),
    [
        (
            Stop(stands=False, text='NOT known to stand: joint1'),
            (502, 'NOT known to stand: joint1\n'),
        ),
        (None, (504, 'no answer from the robot: use the emergency stop\n')),
    ],
)
def test_only_a_robot_that_confirms_has_stopped(
    page: RobotPage,
    actions: Nothing,
    monkeypatch: pytest.MonkeyPatch,
    answer: Stop | None,
    expected: tuple[int, str],
) -> None:
    """That the page's own process has the request says nothing of the robot."""
    monkeypatch.setattr(gate, 'ANSWER_TIMEOUT', 0.1)
    actions.answer = answer
    assert get(page, '/stop', **{STOP_HEADER: '1'})[:2] == expected


def test_two_pages_of_one_host_and_one_that_is_started_again(actions: Nothing) -> None:
    """A browser has the cookies of one host together; STOP of each page works with them."""
    header = {STOP_HEADER: '1'}
    with closing(RobotPage(EVERYWHERE, 8300, cast(Actions, actions))) as second:
        with closing(RobotPage(EVERYWHERE, 8300, cast(Actions, actions))) as first:
            cookies = dict(cookie_of(each)['Cookie'].split('=') for each in (first, second))
            assert len(cookies) == 2, 'the second replaced that of the first'
            jar = '; '.join(f'{name}={value}' for name, value in cookies.items())
            assert get(first, '/stop', Cookie=jar, **header)[0] == 200
            assert get(second, '/stop', Cookie=jar, **header)[0] == 200
            port = urlsplit(first.url).port
        with closing(RobotPage(EVERYWHERE, port or 0, cast(Actions, actions))) as again:
            assert urlsplit(again.url).port == port
            assert get(again, '/stop', Cookie=jar, **header)[0] == 200


@pytest.mark.parametrize('host', ['127.0.0.1', EVERYWHERE, '::', '::1', '127.0.0.2'])
def test_the_url_of_any_binding_opens_the_page(actions: Nothing, host: str) -> None:
    """It names an address of this computer, not the one that stands for all."""
    if ':' in host and binding_problem(host):
        pytest.skip('this computer has no IPv6')
    with closing(RobotPage(host, 8300, cast(Actions, actions))) as page:
        status, text, _ = get(page, **cookie_of(page))
        assert (status, '<html' in text, 'robot-stop' in text) == (200, True, True)
        assert urlsplit(page.url).hostname not in {EVERYWHERE, '::'}


@pytest.mark.parametrize('page', ['127.0.0.1'], indirect=True)
def test_each_name_of_this_host_opens_the_page_and_no_other(page: RobotPage) -> None:
    """As Debian's /etc/hosts has them, and 127.0.0.0/8; not one that was pointed here (DNS)."""
    port = urlsplit(page.url).port
    for host in ('127.0.0.2', 'ip6-localhost', '[::1]', 'localhost'):
        assert get(page, Host=f'{host}:{port}')[0] == 200, host
    status, text, _ = get(page, Host=f'evil.example:{port}')
    assert (status, 'for this host only' in text) == (403, True)


@pytest.mark.parametrize('page', ['127.0.0.1'], indirect=True)
def test_the_page_has_stop_whether_it_is_packed_or_not(page: RobotPage) -> None:
    """Browsers take it packed; and none keeps a page of another version."""
    connection = HTTPConnection('127.0.0.1', urlsplit(page.url).port, timeout=TIMEOUT)
    try:
        connection.request('GET', '/', headers={'Accept-Encoding': 'gzip'})
        answer = connection.getresponse()
        assert answer.headers['Cache-Control'] == 'no-store'
        assert answer.headers['Content-Encoding'] == 'gzip'
        text = gzip.decompress(answer.read()).decode()
        assert text == get(page)[1]
        found = re.search('"modulepreload" href="(/client-[0-9a-f]+.js)"', text)
        assert found is not None, 'the program of viser is a file of its own'
        assert text.count(found[1]) == 2
        connection.close()
        connection.request('GET', found[1])
        answer = connection.getresponse()
        assert answer.headers['Content-Type'] == 'text/javascript'
        assert 'immutable' in answer.headers['Cache-Control']
        assert b'createRoot' in gzip.decompress(answer.read())
    finally:
        connection.close()
    other = b'<html><script data-p="">e.textContent=code</script></html>'
    assert client.split(other) == (other, '', b''), 'one that is packed otherwise'


@pytest.mark.parametrize('page', [EVERYWHERE], indirect=True)
@pytest.mark.parametrize('query', ['', '?token=', '?token=x', '?other=1'])
def test_a_page_that_is_open_to_others_needs_its_token(page: RobotPage, query: str) -> None:
    """In the URL; a wrong cookie is none."""
    wrong = f'{COOKIE.format(urlsplit(page.url).port)}=wrong'
    status, text, cookie = get(page, f'/{query}', Cookie=wrong)
    assert (status, cookie) == (403, '')
    assert 'by the URL that was printed' in text


@pytest.mark.parametrize('path', ['', LIVE_PATH])
@pytest.mark.parametrize('origin', ['http://evil.example', 'http://localhost:1', 'null'])
def test_another_page_gets_no_connection(page: RobotPage, origin: str, path: str) -> None:
    """Any page of a browser of this host may try, with the cookies of ours."""
    cookie, port = cookie_of(page), urlsplit(page.url).port
    address = f'127.0.0.1:{port}'

    def try_it(from_page: str) -> None:
        connect(
            f'ws://{address}{path}',
            origin=Origin(from_page),
            additional_headers=cookie,
            subprotocols=None if path else [Subprotocol('viser-v1.1.1')],
        ).close()

    with pytest.raises(InvalidStatus, match='403'):
        try_it(origin)
    try_it(f'http://{address}')


def test_a_server_that_is_not_guarded_is_none() -> None:
    """A version of viser that serves otherwise must not open the page to everybody."""
    with (
        pytest.raises(RuntimeError, match='asks nobody'),
        Gate('127.0.0.1', Nothing().stop, Live(lambda *_: None)).before(),
    ):
        pass
