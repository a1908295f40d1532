# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page of bring-ups and demos: where it is, and that no robot depends on it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager, suppress
import socket
from typing import TYPE_CHECKING
from urllib.request import urlopen

import browser as chromium
from browser import url_of, viewers_below
from bus_watch import BusRecorder
from processes import executable, find_children, RunningProcess
import psutil
import pytest

if TYPE_CHECKING:
    from isolation import Isolation

pytestmark = [pytest.mark.scenario, pytest.mark.timeout(180)]

STARTING = 60.0  # [s]
SHARED = '/dev/shm/fastrtps'


def start(
    isolation: Isolation, package: str, program: str, *arguments: str, no_view: str = ''
) -> RunningProcess:
    """Start a bring-up or demo with its page, as a person does."""
    env = isolation.env | {'NO_VIEW': no_view}
    return RunningProcess([executable(package, program), *arguments], env)


def is_open(url: str) -> bool:
    """Whether a server listens there."""
    with closing(socket.socket()) as client:
        return client.connect_ex(('127.0.0.1', int(url.rpartition(':')[2]))) == 0


def memory_of_dds(robot: RunningProcess) -> list[str]:
    """Return what its processes share: one that hangs or dies makes the others wait."""
    processes = psutil.Process(robot.pid).children(recursive=True)
    maps = []
    for process in processes:
        with suppress(psutil.Error):  # it has ended meanwhile
            maps += [each.path for each in process.memory_maps()]
    assert maps
    return [path for path in maps if path.startswith(SHARED)]


@contextmanager
def suspended(robot: RunningProcess, program: str) -> Iterator[None]:
    """Stop a program of a robot in the block, as an unplugged cable does."""
    (found,) = find_children(robot.pid, program)
    found.suspend()
    try:
        yield
    finally:
        found.resume()


def see_feet(url: str, dog: RunningProcess) -> None:
    """Walk, look at the feet, and clear a fault on the page, where there is a browser."""
    if chromium.lacking():
        return
    with chromium.browser() as browser:
        page = chromium.open_page(browser, url)
        names = page.locator('[role=tab]').all_inner_texts()
        assert names == ['Drive', 'Body', 'See', 'Diagnose']
        page.get_by_role('button', name='Stand', exact=True).click(force=True)
        chromium.state_is(page, 'STANDING')
        page.locator('.rv-hold.rv-off').get_by_text('Forward', exact=True).wait_for()
        page.get_by_role('button', name='Walk', exact=True).click(force=True)
        chromium.state_is(page, 'READY')
        chromium.hold(page, 'Forward')
        chromium.state_is(page, 'WALKING')
        chromium.picture(page, 'walking')
        page.mouse.up()
        chromium.state_is(page, 'READY')
        chromium.show(page, 'Body')
        page.get_by_text('feet on the ground: bl, br, fl, fr').wait_for()
        page.get_by_text('estimated by joints and attitude; nothing senses it').wait_for()
        page.get_by_text('inside the support').wait_for()
        chromium.picture(page, 'feet')
        with suspended(dog, '/hardware_node'):
            chromium.state_is(page, 'NO CONTACT WITH THE ROBOT')
        chromium.state_is(page, 'FAULT')
        chromium.see_fault(page, '.+', 'Clear fault')
        chromium.picture(page, 'quadruped-fault')
        chromium.act(page, 'Clear fault')
        chromium.state_is(page, 'STANDING|LYING|RELAXED|READY')


def see_it_back(url: str, restart: Callable[[], None]) -> None:
    """See an open page find its server again, which knows of no STOP then."""
    if chromium.lacking():
        restart()
        return
    with chromium.browser() as browser:
        page = chromium.open_page(browser, url)
        chromium.state_is(page, 'NOT ENABLED')
        assert page.title() == 'left/panda: NOT ENABLED', 'tabs of several robots differ'
        page.keyboard.press('Space')
        chromium.state_is(page, 'STOPPED')
        restart()
        chromium.state_is(page, 'NOT ENABLED')


def test_each_robot_has_a_page_and_goes_on_without_it(isolation: Isolation) -> None:
    """Two robots, two pages; one that is killed comes back; both end with their bring-ups.

    After Ctrl-C every drive is disabled, and no process is left.
    """
    arm = ['panda', '--simulate', '--namespace', 'left', '--can', isolation.bus]
    with (
        BusRecorder(isolation.bus) as recorder,
        start(isolation, 'arm_bringup', 'bringup', *arm) as left,
        start(isolation, 'quad_bringup', 'bringup', '--simulate', '--namespace', 'dog') as dog,
    ):
        urls = [url_of(robot, STARTING) for robot in (left, dog)]
        assert urls[0] != urls[1]
        for url in urls:
            with urlopen(url, timeout=20.0) as page:  # noqa: S310  # it begins with http
                assert b'<html' in page.read()
        left.wait_for('all is ready', STARTING)
        dog.wait_for('all is ready', STARTING)
        assert not [path for robot in (left, dog) for path in memory_of_dds(robot)]
        see_feet(urls[1], dog)

        def kill_viewer() -> None:
            (viewer,) = viewers_below(left)
            seen = sum(line.endswith(urls[0]) for line in left.lines)
            viewer.kill()
            left.wait_for('viewer was killed by SIGKILL; it is started again in 1 s', 20.0)
            left.wait_for(f'{urls[0]}$', STARTING, seen + 1)

        see_it_back(urls[0], kill_viewer)
        with urlopen(urls[0], timeout=20.0) as page:  # noqa: S310  # it begins with http
            assert b'robot-stop' in page.read()
        started = psutil.Process(left.pid).children(recursive=True)
        assert left.stop(60.0) == 0, left.output
        assert recorder.last_states() == dict.fromkeys(range(2, 9), 'Switch on disabled')
        assert not psutil.wait_procs(started, timeout=5.0)[1]
        assert is_open(urls[1])
        assert dog.stop(60.0) == 0, dog.output
        assert not is_open(urls[1])
