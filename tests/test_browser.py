# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page of an arm in a real browser: seen, moved and stopped by mouse and keys.

One browser and one arm for all: each test leaves the arm enabled and at rest.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
import re
import time
from typing import TYPE_CHECKING

import browser as chromium
from isolation import reserve
from processes import executable, RunningProcess
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState

from arm_msgs.srv import InjectFault
from robot_viewer.page.target_panel import UNLOCK

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytestmark = [
    pytest.mark.scenario,
    pytest.mark.timeout(300),
    pytest.mark.skipif(bool(chromium.lacking()), reason=chromium.lacking()),
]

STARTING = 90.0  # [s]
REACTION = 15.0  # [s] until a motion begins or ends on a busy machine; real ones are far shorter
REST = 0.6  # [s] of joint states without motion
MOVES = 0.01  # [rad/s]
JOG, TARGETS, DRIVES = 'Jog', 'Targets', 'Drives'
UP = '+ z'
JOINT1 = 1
"""Place of the joint's slider; the speed is above it."""


@dataclass
class Seen:
    """An arm, its page in a browser, and what it really does.

    Attributes:
        browser: The browser.
        url: Of the page.
        page: It, opened once: drawing it without a graphics card costs time.
        client: A ROS node of the test.
        states: The last joint states with the time of their arrival.
    """

    browser: Browser
    url: str
    page: Page
    client: RosClient
    states: deque[tuple[float, JointState]]

    def show(self, tab: str) -> Page:
        """Show a tab of the page."""
        self.page.get_by_role('tab', name=tab).click()
        return self.page

    def unlock(self) -> None:
        """Let the sliders send again, where there was a STOP before."""
        button = self.page.get_by_role('button', name=UNLOCK)
        if button.is_visible():
            button.click()

    def position(self, joint: str = 'panda_joint1') -> float:
        """Return where a joint is in [rad]."""
        message = self.states[-1][1]
        return float(message.position[message.name.index(joint)])

    def moves(self) -> bool:
        """Whether it moves at the moment."""
        return bool(max(map(abs, self.states[-1][1].velocity)) > MOVES)

    def rests(self) -> bool:
        """Whether it has not moved for a while."""
        last = self.states[-1][0]
        if not self.states or last - self.states[0][0] < REST:
            return False
        return all(
            max(map(abs, message.velocity)) < MOVES
            for at, message in self.states
            if at > last - REST
        )

    def wait(self, condition: Callable[[], bool], what: str) -> None:
        """Wait until it does something."""
        self.client.spin_until(condition, REACTION, what)

    def wait_for_rest(self) -> None:
        """Wait until it has come to rest since now."""
        self.states.clear()
        self.wait(lambda: bool(self.states), 'joint states')
        self.wait(self.rests, 'rest')


@pytest.fixture(scope='module')
def seen() -> Iterator[Seen]:
    """Bring an arm up with its page, and start the browser."""
    with reserve() as isolation, RosClient(isolation.domain_id) as client:
        command = [executable('arm_bringup', 'bringup'), 'panda', '--simulate', '--enable']
        command += ['--can', isolation.bus, '--timeout', f'{STARTING:g}']
        with RunningProcess(command, isolation.env | {'NO_VIEW': ''}) as bringup:
            line = bringup.wait_for(r'the robot is seen at http://localhost:\d+$', STARTING)
            bringup.wait_for('are enabled', STARTING)
            states: deque[tuple[float, JointState]] = deque(maxlen=500)
            client.node.create_subscription(
                JointState,
                '/joint_states',
                lambda message: states.append((time.monotonic(), message)),
                10,
            )
            client.spin_until(lambda: bool(states), REACTION, 'joint states')
            with chromium.browser() as browser:
                url = line.rpartition(' ')[2]
                yield Seen(browser, url, chromium.open_page(browser, url), client, states)


def test_a_slider_moves_a_joint_that_is_seen_on_all_pages(seen: Seen) -> None:
    """The robot is drawn; its joint states follow the slider; another page shows the same."""
    page, other = seen.show(TARGETS), chromium.open_page(seen.browser, seen.url)
    seen.unlock()
    other.get_by_role('tab', name=TARGETS).click()
    before = chromium.picture(page, 'arm')
    assert chromium.colors_of_scene(before) > 100
    start = seen.position()
    chromium.drag(page, JOINT1, 0.65)
    wanted = chromium.slider_value(page, JOINT1)
    assert wanted > start + 0.3
    seen.wait(lambda: abs(seen.position() - wanted) < 0.02, f'{wanted} rad')
    page.get_by_text('target: reached').wait_for()
    assert chromium.slider_value(other, JOINT1) == pytest.approx(wanted, abs=0.02)
    assert chromium.picture(page, 'arm-moved') != before
    other.close()


def test_stop_of_any_page_ends_a_jog(seen: Seen) -> None:
    """Also while the button is still held: only a new press moves the arm again."""
    page, other = seen.show(JOG), chromium.open_page(seen.browser, seen.url)
    chromium.hold(page, UP)
    seen.wait(seen.moves, 'a jog')
    other.locator('#robot-stop').click()
    seen.wait_for_rest()
    other.get_by_text('received').wait_for()
    other.close()
    page.mouse.up()
    seen.wait_for_rest()
    chromium.hold(page, UP)
    seen.wait(seen.moves, 'a jog again')
    page.mouse.up()
    seen.wait_for_rest()


def test_the_space_bar_ends_a_trajectory(seen: Seen) -> None:
    """The arm stands on the way, and the page says so; the key presses no button."""
    page = seen.show(TARGETS)
    seen.unlock()
    chromium.drag(page, JOINT1, 0.1)
    wanted = chromium.slider_value(page, JOINT1)
    seen.wait(seen.moves, 'a motion')
    page.keyboard.press('Space')
    seen.wait_for_rest()
    assert abs(seen.position() - wanted) > 0.2
    page.get_by_text('halted').wait_for()
    chromium.picture(page, 'stopped')
    page.get_by_role('button', name=UNLOCK).wait_for()
    chromium.drag(page, JOINT1, 0.1)  # as if one were dragged on, or late
    seen.wait_for_rest()
    assert abs(seen.position() - wanted) > 0.2
    seen.unlock()
    chromium.drag(page, JOINT1, 0.1)
    seen.wait(seen.moves, 'a motion again')
    page.get_by_text('target: reached').wait_for()


@pytest.mark.parametrize('way', ['asleep', 'elsewhere'])
def test_who_does_not_look_moves_nothing(seen: Seen, way: str) -> None:
    """A browser that is stopped, and a window that loses the focus."""
    page = seen.show(JOG)
    chromium.hold(page, UP)
    seen.wait(seen.moves, 'a jog')
    if way == 'asleep':
        with chromium.asleep():
            seen.wait_for_rest()
    else:
        page.evaluate("window.dispatchEvent(new Event('blur'))")
        seen.wait_for_rest()
    page.mouse.up()
    seen.wait_for_rest()


def test_a_page_that_is_killed_moves_nothing(seen: Seen) -> None:
    """With a button held; the browser has no time to say so."""
    others = chromium.processes()
    page = chromium.open_page(chromium.launch(seen.browser.browser_type), seen.url)
    page.get_by_role('tab', name=JOG).click()
    chromium.hold(page, UP)
    seen.wait(seen.moves, 'a jog')
    for process in chromium.processes():
        if process not in others:
            process.kill()
    seen.wait_for_rest()


def test_stop_is_in_reach_on_a_phone(seen: Seen) -> None:
    """In front of everything, on a screen of that size, by touch, with the panel open."""
    options = {'viewport': {'width': 390, 'height': 780}, 'has_touch': True, 'is_mobile': True}
    context = seen.browser.new_context(**options)  # type: ignore[arg-type]
    page = context.new_page()
    page.goto(seen.url)
    stop = page.locator('#robot-stop')
    stop.wait_for(timeout=chromium.PAGE_TIMEOUT)
    box = stop.bounding_box()
    assert box is not None
    assert min(box['width'], box['height']) > 48  # [px] what a thumb hits
    page.touchscreen.tap(box['x'] + box['width'] / 2, box['y'] + box['height'] / 2)
    page.get_by_text('received').wait_for(timeout=chromium.PAGE_TIMEOUT)
    page.get_by_role('tab', name='Joints').wait_for(timeout=chromium.PAGE_TIMEOUT)
    chromium.picture(page, 'phone')
    context.close()


def test_a_fault_is_shown_with_its_reason(seen: Seen) -> None:
    """The one of the drive, and its state, EMCY and statusword in words."""
    page = seen.show(DRIVES)
    request = InjectFault.Request(device='panda_joint3', fault='over_current')
    answer = seen.client.call(InjectFault, '/fake_slaves/fault', request)
    assert answer.success, answer.message
    page.get_by_text(re.compile('panda_joint3: drive: .*over.?current', re.IGNORECASE)).wait_for()
    page.locator('input:visible').first.click()  # the only one of this tab
    page.get_by_role('option', name='/panda_joint3', exact=True).click()
    page.get_by_role('cell', name='Fault', exact=True).wait_for()
    chromium.picture(page, 'fault')
