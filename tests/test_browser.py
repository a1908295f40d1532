# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page of an arm in a real browser: seen, moved and stopped by mouse and keys.

One browser and one arm for all: each test leaves the arm at rest, and chooses on the page what it
needs there.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future
from contextlib import closing
from dataclasses import dataclass, field
import re
import threading
import time
from types import SimpleNamespace
from typing import cast, TYPE_CHECKING

import browser as chromium
from geometry_msgs.msg import Point, Pose
from isolation import reserve
from moveit_msgs.msg import CollisionObject, PlanningScene
from moveit_msgs.srv import ApplyPlanningScene, GetPlanningScene
from processes import executable, RunningProcess
import psutil
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState
from shape_msgs.msg import SolidPrimitive

from arm_msgs.srv import InjectFault
from robot_viewer.page.jog_panel import BASE
from robot_viewer.page.motion_plan import DRAGGED
from robot_viewer.page.overlay import StopAnswer
from robot_viewer.page.robot_page import Actions, RobotPage
from robot_viewer.page.target_panel import UNLOCK

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

pytestmark = [
    pytest.mark.scenario,
    pytest.mark.timeout(300),
    pytest.mark.skipif(bool(chromium.lacking()), reason=chromium.lacking()),
]

STARTING = 90.0  # [s]
REACTION = 60.0  # [s] until a motion begins or ends on a busy machine; real ones are far shorter
REST = 0.6  # [s] of joint states without motion
MOVES = 0.01  # [rad/s]
NEAR = 0.01  # [rad] of a target
UNDER_WAY = 0.05  # [rad] from its start: STOP names joints that move, and a motion starts softly
JOG, TARGETS, DRIVES, PLAN = 'Jog', 'Targets', 'Drives', 'Plan'
TURN, TURN_BACK = '+ about z', '− about z'
WRIST = 'panda_joint7'
"""Turns the tool, which points downwards, about the z axis."""
READY_TIP = (0.307, 0.0, 0.59)
"""Where the tip is in the state 'ready' of the SRDF, in [m]."""
JOINT1 = 1
"""Place of the joint's slider; the speed is above it."""


@dataclass
class Seen:
    """An arm, its page in a browser, and what it really does.

    Attributes:
        bringup: The programs of the arm.
        browser: The browser.
        url: Of the page.
        page: It, opened once: drawing it without a graphics card costs time.
        client: A ROS node of the test.
        states: The last joint states with the time of their arrival.
        wrist: Where that joint was in the beginning in [rad].
        ready: Where all were, which is the state of the SRDF of that name.
    """

    bringup: RunningProcess
    browser: Browser
    url: str
    page: Page
    client: RosClient
    states: deque[tuple[float, JointState]]
    wrist: float = field(init=False)
    ready: Sequence[float] = field(init=False)

    def __post_init__(self) -> None:
        self.wrist = self.position(WRIST)
        self.ready = self.states[-1][1].position

    def show(self, tab: str) -> Page:
        """Show a tab of the page."""
        self.page.get_by_role('tab', name=tab).click()
        return self.page

    def unlock(self) -> None:
        """Let the sliders send again, where there was a STOP before."""
        button = self.page.get_by_role('button', name=UNLOCK)
        if button.is_visible():
            button.click()
            button.wait_for(state='hidden')  # the sliders below it move up

    def box(self, slider: int) -> Locator:
        """Return the number box beside a slider of the open tab."""
        return self.page.locator('input[inputmode=decimal]:visible').nth(slider)

    def type_into(self, slider: int, text: str) -> None:
        """Type into the number box beside a slider of the open tab, without an end."""
        self.box(slider).click()
        self.page.keyboard.press('Control+a')
        self.page.keyboard.type(text)
        assert self.box(slider).input_value() == text

    def jog(self, page: Page) -> None:
        """Turn the tool about the base's axis; back, as at its limit the joint would not move."""
        page.get_by_role('tab', name=JOG).click()
        page.get_by_role('tab', name='Tool', exact=True).click()
        chromium.choose(page, 'Along the axes of', BASE)
        chromium.hold(page, TURN if self.position(WRIST) > self.wrist else TURN_BACK)
        self.wait(self.moves, 'a jog')

    def position(self, joint: str = 'panda_joint1') -> float:
        """Return where a joint is in [rad]."""
        message = self.states[-1][1]
        return float(message.position[message.name.index(joint)])

    def way(self) -> float:
        """Return how far it is from the state 'ready' in [rad]."""
        pairs = zip(self.states[-1][1].position, self.ready, strict=True)
        return float(max(abs(position - ready) for position, ready in pairs))

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

    def wait_until_at(self, target: float) -> None:
        """Wait until the first joint stands at a target in [rad]."""
        self.wait(lambda: abs(self.position() - target) < NEAR, f'{target} rad')
        self.wait_for_rest()

    def wait_for_rest(self) -> None:
        """Wait until it has come to rest since now."""
        self.states.clear()
        self.wait(lambda: bool(self.states), 'joint states')
        self.wait(self.rests, 'rest')


@pytest.fixture(scope='module')
def seen() -> Iterator[Seen]:
    """Bring an arm up with its page, and start the browser."""
    with reserve() as isolation, RosClient(isolation.domain_id) as client:
        command = [
            executable('arm_bringup', 'bringup'),
            'panda',
            '--simulate',
            '--enable',
            '--plan',
        ]
        command += ['--can', isolation.bus, '--timeout', f'{STARTING:g}']
        with RunningProcess(command, isolation.env | {'NO_VIEW': ''}) as bringup:
            url = chromium.url_of(bringup, STARTING)
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
                yield Seen(bringup, browser, url, chromium.open_page(browser, url), client, states)


def words_of_stop(page: Page, pattern: str) -> Locator:
    """Return the words on the STOP button once they match."""
    return page.locator('#robot-stop small').filter(has_text=re.compile(pattern))


def press(page: Page, button: str) -> None:
    """Press a button of the open tab."""
    page.get_by_role('button', name=button, exact=True).click()


def add_box(seen: Seen, place: tuple[float, float, float]) -> None:
    """Have a small box in the scene of move_group, as any client does."""
    scene = PlanningScene(is_diff=True)
    scene.robot_state.is_diff = True
    box = CollisionObject(id='pillar', operation=CollisionObject.ADD)
    box.header.frame_id = 'panda_link0'
    box.primitives.append(SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.1, 0.1, 0.1]))
    at = Point(**dict(zip('xyz', place, strict=True)))
    box.primitive_poses.append(Pose(position=at))
    scene.world.collision_objects.append(box)
    request = ApplyPlanningScene.Request(scene=scene)
    assert seen.client.call(ApplyPlanningScene, '/apply_planning_scene', request).success


def test_a_dragged_goal_and_a_box(seen: Seen) -> None:
    """Both by the mouse in the scene: the tip goes elsewhere, and the box is where it is left."""
    page = seen.show(PLAN)
    chromium.choose(page, 'Goal', DRAGGED)
    chromium.drag_arrow(page, 'green', 40)
    press(page, 'Plan')
    page.get_by_text('the motion takes').wait_for()
    chromium.picture(page, 'plan-dragged')
    press(page, 'Execute')
    page.get_by_text('executed').wait_for()
    seen.wait(lambda: seen.way() > 0.05, 'another place')
    press(page, 'Add a box')
    page.get_by_text('box1 is added').wait_for()
    chromium.picture(page, 'box')
    chromium.drag_arrow(page, 'red', 30)
    page.get_by_text('box1 is moved').wait_for()
    request = GetPlanningScene.Request()
    request.components.components = request.components.WORLD_OBJECT_GEOMETRY
    (box,) = seen.client.call(
        GetPlanningScene, '/get_planning_scene', request
    ).scene.world.collision_objects
    assert box.pose != Pose(position=Point(x=0.6, z=0.1)), 'moved or turned'
    press(page, 'Remove it')
    page.get_by_text('box1 is removed').wait_for()


def test_stop_ends_what_was_planned(seen: Seen) -> None:
    """On its way; what was planned cannot be executed any more."""
    seen.show(TARGETS)
    seen.unlock()
    seen.type_into(JOINT1, '1')
    seen.page.keyboard.press('Enter')
    seen.wait_until_at(1.0)
    page = seen.show(PLAN)
    chromium.choose(page, 'Goal', 'ready')
    chromium.drag(page, 0, 0.0)  # slowly: it is on its way for long
    press(page, 'Plan')
    page.get_by_text('the motion takes').wait_for()
    press(page, 'Execute')
    seen.wait(seen.moves, 'a motion')
    page.locator('#robot-stop').click()
    seen.wait_for_rest()
    page.get_by_text(re.compile('PREEMPTED|CONTROL_FAILED')).wait_for()
    assert page.get_by_role('button', name='Execute', exact=True).is_disabled()
    chromium.picture(page, 'plan-stopped')
    chromium.drag(page, 0, 0.5)
    assert seen.way() > 0.05


def test_a_goal_is_planned_shown_and_executed(seen: Seen) -> None:
    """A state of the SRDF: blocked by a box first, in the words of move_group, then free."""
    page = seen.show(PLAN)
    add_box(seen, READY_TIP)
    chromium.choose(page, 'Goal', 'ready')
    press(page, 'Plan')
    # where STOP ended the motion before is as near as chance has it
    page.get_by_text(re.compile('(GOAL|START_STATE)_IN_COLLISION: .*pillar')).wait_for()
    chromium.picture(page, 'plan-blocked')
    assert page.get_by_role('button', name='Execute', exact=True).is_disabled()
    chromium.choose(page, 'Object', 'pillar')
    press(page, 'Remove it')
    page.get_by_text('pillar is removed').wait_for()
    press(page, 'Plan')
    page.get_by_text('the motion takes').wait_for()
    chromium.picture(page, 'plan')
    assert not seen.moves()
    press(page, 'Execute')
    page.get_by_text('executed').wait_for()
    seen.wait(lambda: seen.way() < 0.01, 'the goal')


def test_a_slider_moves_a_joint_that_is_seen_on_all_pages(seen: Seen) -> None:
    """The robot is drawn; its joint states follow the slider; another page shows the same."""
    page, other = seen.show(TARGETS), chromium.open_page(seen.browser, seen.url)
    seen.unlock()
    other.get_by_role('tab', name=TARGETS).click()
    before = chromium.picture(page, 'arm')
    assert chromium.colors_of_scene(before) > 100
    start = seen.position()
    chromium.drag(page, JOINT1, 0.65 if start < 0.0 else 0.35)
    wanted = chromium.slider_value(page, JOINT1)
    assert abs(wanted - start) > 0.3
    seen.wait_until_at(wanted)
    page.get_by_text('target: reached').wait_for()
    seen.wait(lambda: abs(chromium.slider_value(other, JOINT1) - wanted) < 0.02, 'the other page')
    assert chromium.picture(page, 'arm-moved') != before
    other.close()


def test_stop_of_any_page_ends_a_jog(seen: Seen) -> None:
    """Also while the button is still held: only a new press moves the arm again."""
    page, other = seen.page, chromium.open_page(seen.browser, seen.url)
    seen.jog(page)
    other.locator('#robot-stop').click()
    words_of_stop(other, '^(stopped|stand): ').wait_for()
    seen.wait_for_rest()
    other.close()
    page.mouse.up()
    seen.wait_for_rest()
    seen.jog(page)
    page.mouse.up()
    seen.wait_for_rest()


def test_the_space_bar_ends_a_trajectory(seen: Seen) -> None:
    """The arm stands on the way, and the page says so; the key presses no button."""
    page = seen.show(TARGETS)
    seen.unlock()
    share = 0.1 if seen.position() > 0.0 else 0.9
    chromium.drag(page, JOINT1, share)
    wanted, start = chromium.slider_value(page, JOINT1), seen.position()
    seen.wait(lambda: abs(seen.position() - start) > UNDER_WAY, 'a motion')
    page.keyboard.press('Space')
    seen.wait_for_rest()
    assert abs(seen.position() - wanted) > 0.2
    words_of_stop(page, 'stopped: panda_joint1').wait_for()
    chromium.picture(page, 'stopped')
    page.get_by_role('button', name=UNLOCK).wait_for()
    chromium.drag(page, JOINT1, share)  # as if one were dragged on, or late
    seen.wait_for_rest()
    assert abs(seen.position() - wanted) > 0.2
    seen.unlock()
    chromium.drag(page, JOINT1, share)
    seen.wait(seen.moves, 'a motion again')
    page.get_by_text('target: reached').wait_for()


def test_a_number_counts_when_it_is_complete(seen: Seen) -> None:
    """Its first digit is no target; the space bar is STOP also while it is being typed."""
    page = seen.show(TARGETS)
    seen.unlock()
    seen.wait_for_rest()
    start = seen.position()
    wanted = 2.5 if start < 0.5 else -2.5
    seen.type_into(JOINT1, f'{wanted}')
    seen.wait_for_rest()
    assert abs(seen.position() - start) < MOVES, 'half a number was sent'
    page.keyboard.press('Enter')
    seen.wait(lambda: abs(seen.position() - start) > UNDER_WAY, 'a motion')
    page.keyboard.press('Space')
    words_of_stop(page, 'stopped: panda_joint1').wait_for()
    seen.wait_for_rest()
    assert abs(seen.position() - wanted) > 0.2
    before = dict(zip(seen.states[-1][1].name, seen.states[-1][1].position, strict=True))
    seen.unlock()
    for text, end in (('0', 'Enter'), ('0,5', 'Tab')):  # the second is longer than what is shown
        seen.type_into(JOINT1, text)
        page.keyboard.press(end)
        seen.wait_until_at(float(text.replace(',', '.')))
    seen.type_into(JOINT1, '1e0')
    page.keyboard.press('Enter')
    assert seen.box(JOINT1).input_value() == '0.5', 'no number'
    seen.wait_for_rest()
    assert abs(seen.position() - 0.5) < NEAR
    others = set(before) - {'panda_joint1'}
    assert max(abs(seen.position(joint) - before[joint]) for joint in others) < 0.002


def test_a_single_joint_and_the_tool_along_its_own_axes(seen: Seen) -> None:
    """The other joints stand; the tool goes where it points, which is down."""
    page = seen.show(JOG)
    page.get_by_role('tab', name='Single joints').click()
    before, start = seen.states[-1][1], seen.position(WRIST)
    chromium.hold(page, '7 −' if seen.position(WRIST) > seen.wrist else '7 +')
    seen.wait(lambda: abs(seen.position(WRIST) - start) > UNDER_WAY, 'a jog')
    page.mouse.up()
    seen.wait_for_rest()
    for name, position in zip(before.name, before.position, strict=True):
        assert name == WRIST or abs(seen.position(name) - position) < MOVES, name
    chromium.picture(page, 'jog-joints')
    page.get_by_role('tab', name='Tool', exact=True).click()
    chromium.choose(page, 'Along the axes of', 'panda_link7')
    chromium.hold(page, '− z')
    seen.wait(seen.moves, 'a jog')
    page.mouse.up()
    seen.wait_for_rest()
    chromium.picture(page, 'jog-tool')


@pytest.mark.parametrize('way', ['asleep', 'elsewhere'])
def test_who_does_not_look_moves_nothing(seen: Seen, way: str) -> None:
    """A browser that is stopped, and a window that loses the focus."""
    page = seen.page
    seen.jog(page)
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
    seen.jog(page)
    for process in chromium.processes():
        if process not in others:
            process.kill()
    seen.wait_for_rest()


def test_stop_is_in_reach_on_a_phone(seen: Seen) -> None:
    """In front of everything, on a screen of that size, by touch, with the panel open."""
    options = {'viewport': {'width': 390, 'height': 780}, 'has_touch': True, 'is_mobile': True}
    context = seen.browser.new_context(**options)  # type: ignore[arg-type]
    page = context.new_page()
    page.set_default_timeout(chromium.PAGE_TIMEOUT)
    page.goto(seen.url)
    stop = page.locator('#robot-stop')
    stop.wait_for()
    box = stop.bounding_box()
    assert box is not None
    assert min(box['width'], box['height']) > 48  # [px] what a thumb hits
    page.touchscreen.tap(box['x'] + box['width'] / 2, box['y'] + box['height'] / 2)
    words_of_stop(page, '^(stand|not enabled): ').wait_for()
    page.get_by_role('tab', name='Joints').wait_for()
    jog = page.get_by_role('tab', name=JOG)
    jog.tap()
    page.get_by_role('button', name=TURN, exact=True).wait_for()
    middle = 'document.elementFromPoint(195, 170).tagName'
    assert page.evaluate(middle) == 'CANVAS', 'the panel hides the robot'
    tab = jog.bounding_box()
    assert tab is not None
    assert tab['y'] > 200
    assert box['y'] > 640, 'a thumb holds the phone below'
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


def test_a_robot_that_does_not_answer_has_not_stopped(seen: Seen) -> None:
    """Its process hangs: the page says what to do; with a dropdown open, by the space bar."""
    page = seen.show(DRIVES)
    page.locator('input:visible').first.click()
    robot = [
        child
        for child in psutil.Process(seen.bringup.pid).children(recursive=True)
        if any(word.endswith('/motion_node') for word in child.cmdline())
    ]
    assert robot
    for process in robot:
        process.suspend()
    try:
        page.keyboard.press('Space')
        page.get_by_text('no answer from the robot: use the emergency stop').wait_for()
        chromium.picture(page, 'no-answer')
    finally:
        for process in robot:
            process.resume()
    words_of_stop(page, 'stand|not enabled|NOT confirmed').wait_for()


def test_a_robot_that_stops_late(seen: Seen) -> None:
    """The warning gives way to its words, however often STOP was pressed until then."""
    answers, stands = list[Future[StopAnswer]](), threading.Event()
    answer = StopAnswer(stands=True, text='stopped: legs')

    def stop() -> Future[StopAnswer]:
        answers.append(Future())
        if stands.is_set():
            answers[-1].set_result(answer)
        return answers[-1]

    with closing(
        RobotPage('127.0.0.1', 8600, cast(Actions, SimpleNamespace(stop=stop)))
    ) as served:
        page = seen.browser.new_page()
        page.goto(served.url)
        words_of_stop(page, 'space bar').wait_for()
        for _ in range(9):  # more than a browser sends at once
            page.keyboard.press('Space')
        words_of_stop(page, 'no answer from the robot: use the emergency stop').wait_for()
        count = len(answers)
        page.keyboard.press('Space')
        seen.wait(lambda: len(answers) > count, 'a STOP behind those that are not answered')
        stands.set()
        for each in answers:
            if not each.done():
                each.set_result(answer)
        words_of_stop(page, '^stopped: legs$').wait_for()
        page.close()
