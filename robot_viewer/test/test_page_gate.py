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
from typing import cast
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


def test_a_held_button_counts_from_the_first_heartbeat_on() -> None:
    """Each one, as the browser's timer makes them."""
    deadman = Deadman()
    assert all(deadman.beat(1, 'hold', 10.0 + number * HEARTBEAT) for number in range(50))


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


def test_a_page_that_is_closed_has_no_control() -> None:
    """Another one has it with its first heartbeat."""
    deadman = Deadman()
    assert deadman.beat(1, 'hold', 10.0)
    assert not deadman.beat(2, 'hold', 20.0)
    deadman.leave(1)
    assert not deadman.beat(2, 'hold', 20.1)  # it was refused: under a finger that waits
    deadman.release(2, 'hold', 20.2)
    assert deadman.beat(2, 'hold', 20.3)


def test_a_press_that_may_not_move_anything_has_to_be_made_anew() -> None:
    """What it was refused for may end while it is held."""
    deadman = Deadman()
    deadman.bar(1, 'hold')
    assert not deadman.beat(1, 'hold', 10.0)
    deadman.release(1, 'hold', 10.1)
    assert deadman.beat(1, 'hold', 10.2)


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


def test_a_button_that_nobody_held_counts_after_a_stop_at_once() -> None:
    """It was let go before; what is late of it does not count."""
    deadman = Deadman()
    assert deadman.beat(1, 'hold', 10.0)
    deadman.release(1, 'hold', 10.1)
    assert not deadman.beat(1, 'hold', 10.1 + 0.1 * HEARTBEAT)
    deadman.stop()
    assert deadman.beat(1, 'hold', 11.0)


def test_a_button_that_was_taken_off_the_page_bars_no_other() -> None:
    """Its page cannot let it go any more; the one that came in its place was never held."""
    deadman = Deadman()
    assert deadman.beat(1, 'hold', 10.0)
    deadman.stop()
    assert not deadman.beat(1, 'hold', 11.0)
    assert deadman.beat(1, 'its successor', 11.0)


def test_a_press_whose_work_has_ended_is_held_no_more() -> None:
    """Its heartbeats go on under a finger that has not seen it; it has to be pressed anew."""
    deadman = Deadman()
    assert deadman.beat(1, 'hold', 10.0)
    deadman.end('another')
    assert deadman.held(10.0)
    deadman.end('hold')
    assert not deadman.held(10.0)
    assert not deadman.beat(1, 'hold', 10.1)
    deadman.release(1, 'hold', 10.2)
    assert deadman.beat(1, 'hold', 10.3)


TIMEOUT = 10.0  # [s]
EVERYWHERE = '0.0.0.0'  # noqa: S104  # what is tested is that it is guarded


class Nothing:
    """Counts what stops; nothing else is asked for."""

    def __init__(self) -> None:
        """Begin with none, and a robot that has stopped."""
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


@pytest.mark.parametrize('host', [EVERYWHERE, '::', '::1', '127.0.0.2'])
def test_the_url_of_any_binding_opens_the_page(actions: Nothing, host: str) -> None:
    """It names an address of this computer, not the one that stands for all."""
    if ':' in host and binding_problem(host):
        pytest.skip('this computer has no IPv6')
    with closing(RobotPage(host, 8300, cast(Actions, actions))) as page:
        status, text, _ = get(page, **cookie_of(page))
        assert (status, '<html' in text) == (200, True)
        assert urlsplit(page.url).hostname not in {EVERYWHERE, '::'}


@pytest.mark.parametrize('page', ['127.0.0.1'], indirect=True)
@pytest.mark.parametrize('host', ['127.0.0.2', 'ip6-localhost', '[::1]', 'localhost'])
def test_each_name_of_this_host_opens_the_page(page: RobotPage, host: str) -> None:
    """As /etc/hosts of Debian has them, and the addresses of 127.0.0.0/8."""
    assert get(page, Host=f'{host}:{urlsplit(page.url).port}')[0] == 200


@pytest.mark.parametrize('page', [EVERYWHERE], indirect=True)
def test_a_link_of_another_site_opens_the_page(page: RobotPage) -> None:
    """The cookie comes with the request that follows; not with those that the site makes."""
    assert 'SameSite=Lax' in get(page, f'/?{urlsplit(page.url).query}')[2]


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


@pytest.mark.parametrize('page', ['127.0.0.1'], indirect=True)
def test_a_name_that_was_pointed_to_this_host_opens_nothing(page: RobotPage) -> None:
    """DNS rebinding: the browser takes the page for one of elsewhere."""
    status, text, _ = get(page, Host=f'evil.example:{urlsplit(page.url).port}')
    assert status == 403
    assert 'for this host only' in text


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
