# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page of an arm in a real browser: seen, moved and stopped by mouse and keys.

One browser and one arm for all: each test leaves the arm at rest, and chooses on the page what it
needs there.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing, contextmanager, suppress
from dataclasses import dataclass, field
import re
import threading
import time
from types import SimpleNamespace
from typing import Any, cast, TYPE_CHECKING

import browser as chromium
from geometry_msgs.msg import Point, Pose
from isolation import reserve
from moveit_msgs.msg import CollisionObject, PlanningScene
from moveit_msgs.srv import ApplyPlanningScene, GetPlanningScene
from processes import executable, find_children, RunningProcess
import psutil
import pytest
from ros_client import RosClient
from sensor_msgs.msg import JointState
from shape_msgs.msg import SolidPrimitive

from arm_msgs.srv import InjectFault
from robot_viewer.nodes.motion_planning import DRAGGED, HOLD_EXECUTE
from robot_viewer.page.jog_panel import Actions, BASE, HOLD_TARGET
from robot_viewer.page.robot_page import Overlay, RobotPage
from robot_viewer.robot_state import ALLOW, Level, RobotState, Stop

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page

pytestmark = [
    pytest.mark.scenario,
    pytest.mark.timeout(300),
    pytest.mark.skipif(bool(chromium.lacking()), reason=chromium.lacking()),
]

NICE = ('nice', '-n', '5')
STARTING = 90.0  # [s]
REACTION = 60.0  # [s] until a motion begins or ends on a busy machine; real ones are far shorter
REST = 0.6  # [s] of joint states without motion
MOVES = 0.01  # [rad/s]
NEAR = 0.01  # [rad] of a target
UNDER_WAY = 0.05  # [rad] from its start: STOP names joints that move, and a motion starts softly
TURN, TURN_BACK = 'Turn Z +', 'Turn Z −'
WRIST = 'panda_joint7'
"""Turns the tool, which points downwards, about the z axis."""
READY_TIP = (0.307, 0.0, 0.59)
"""Where the tip is in the state 'ready' of the SRDF, in [m]."""
GROUPS = ['Drive', 'Plan', 'See', 'Diagnose']
SOON = 10_000  # [ms] for 2 s to a fault and 3 s to the loss of the robot, on a busy machine
WORDS_OF_STOP = """window.said = []; new MutationObserver(() => window.said.push(
  document.querySelector('#robot-stop small').innerText)).observe(
  document.querySelector('#robot-stop'), {subtree: true, childList: true, characterData: true})"""
"""Keeps them in ``window.said``."""
JOINT1 = 1
"""Place of the joint's slider in the tab of the target; the speed is above it."""


@dataclass
class Seen:
    """An arm, its page in a browser, and what it really does."""

    bringup: RunningProcess  # the programs of the arm
    viewer: RunningProcess  # the program that serves its page
    browser: Browser  # the browser
    url: str  # of the page
    # it, opened once, before there was a robot: drawing it without a graphics card costs time
    page: Page
    client: RosClient  # a ROS node of the test
    states: deque[tuple[float, JointState]]  # the last joint states with the time of their arrival
    wrist: float = field(init=False)  # where that joint was in the beginning in [rad]
    # where all were, which is the state of the SRDF of that name
    ready: Sequence[float] = field(init=False)

    def __post_init__(self) -> None:
        self.wrist = self.position(WRIST)
        self.ready = self.states[-1][1].position

    def show(self, group: str, tab: str = '') -> Page:
        """Show a group of the page, and a tab in it, in which motion is allowed."""
        chromium.show(self.page, group, *([tab] if tab else []))
        self.allow(self.page)
        return self.page

    def allow(self, page: Page) -> None:
        """Allow motion where there was a STOP before, and take control where another page has it.

        A page keeps it until it is closed, whatever test has held a button there.
        """
        if page.locator('#rv-do').inner_text() == ALLOW:
            chromium.act(page, ALLOW)
        page.locator('body:not(.rv-stopped)').wait_for()
        if page.locator('#rv-take').is_visible():
            page.locator('#rv-take').click(force=True)
            page.locator('body:not(.rv-other)').wait_for()

    def heal(self) -> None:
        """Recover drives that have lost their master on a busy machine; wait until it is ready."""
        state, action = (self.page.locator(f'#rv-{name}') for name in ('state b', 'do'))
        deadline = time.monotonic() + REACTION
        while (shown := state.inner_text()) != 'READY' and action.inner_text() != ALLOW:
            assert time.monotonic() < deadline, f'the arm stays in {shown}'
            if action.inner_text().startswith('Recover'):
                chromium.act(self.page, 'Recover')
            self.page.wait_for_timeout(chromium.STANDS)

    def box(self, slider: int) -> Locator:
        """Return the number box beside a slider of the open tab."""
        return self.page.locator('input[inputmode=decimal]:visible').nth(slider)

    def type_into(self, slider: int, text: str) -> None:
        """Type into the number box beside a slider of the open tab, without an end."""
        self.box(slider).click(force=True)
        self.page.keyboard.press('Control+a')
        self.page.keyboard.type(text)
        assert self.box(slider).input_value() == text

    def jog(self, page: Page) -> None:
        """Turn the tool about the base's axis; back, as at its limit the joint would not move."""
        self.allow(page)
        chromium.show(page, 'Drive', 'Tool')
        chromium.choose(page, 'Along axes of', BASE)
        chromium.hold(page, TURN if self.position(WRIST) > self.wrist else TURN_BACK)
        self.wait(self.moves, 'a jog')

    def move_to(self, target: float, name: str = '') -> None:
        """Move the first joint to a target, by its number box and the button that is held."""
        page = self.show('Drive', 'Target')
        self.type_into(JOINT1, f'{target}')
        page.keyboard.press('Enter')
        chromium.hold(page, HOLD_TARGET)
        self.wait_until_at(target)
        page.mouse.up()
        if name:
            chromium.picture(page, name)

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
    """Open a page, and bring an arm up as it says."""
    with (
        reserve() as isolation,
        RosClient(isolation.domain_id) as client,
        RunningProcess([*NICE, executable('robot_viewer', 'web_viewer')], isolation.env) as viewer,
        chromium.browser() as browser,
    ):
        url = chromium.url_of(viewer, STARTING)
        page = chromium.open_page(browser, url, robot='')
        chromium.state_is(page, 'NO ROBOT')
        assert page.locator('[role=tab]').all_inner_texts() == GROUPS
        # the first command of the card, and planning
        _, _, package, program, *arm = page.locator('#rv-first code').first.inner_text().split()
        more = '--plan', '--can', isolation.bus, '--timeout', f'{STARTING:g}'
        command = [executable(package, program), *arm, *more]
        with RunningProcess(command, isolation.env) as bringup:
            states: deque[tuple[float, JointState]] = deque(maxlen=500)
            client.node.create_subscription(
                JointState,
                '/joint_states',
                lambda message: states.append((time.monotonic(), message)),
                10,
            )
            bringup.wait_for('are enabled', STARTING)
            client.spin_until(lambda: bool(states), REACTION, 'joint states')
            chromium.state_is(page, 'READY')
            page.locator('#rv-first').wait_for(state='hidden')
            assert page.locator('[role=tab]').all_inner_texts()[: len(GROUPS)] == GROUPS
            yield Seen(bringup, viewer, browser, url, page, client, states)


@pytest.fixture(autouse=True)
def one_page(seen: Seen) -> Iterator[None]:
    """Begin with an arm that is ready and an empty scene; close pages that a test leaves open."""
    seen.heal()
    for box in objects(seen):
        change_scene(seen, CollisionObject(id=box.id, operation=CollisionObject.REMOVE))
    yield
    seen.page.mouse.up()
    seen.page.set_default_timeout(chromium.PAGE_TIMEOUT)
    for context in seen.browser.contexts:
        if context is not seen.page.context:
            context.close()


def words_of_stop(page: Page, pattern: str) -> Locator:
    """Return the words on the STOP button once they match."""
    return page.locator('#robot-stop small').filter(has_text=re.compile(pattern))


def press(page: Page, button: str) -> None:
    """Press a button of the open tab."""
    chromium.press(page.get_by_role('button', name=button, exact=True))


def execute(page: Page) -> None:
    """Plan and hold until it is executed; planned anew where a beat of the page came late."""
    deadline = time.monotonic() + 2.0 * REACTION
    while True:
        press(page, 'Plan motion')
        page.get_by_text('the motion takes').wait_for()
        chromium.hold(page, HOLD_EXECUTE)
        ended = page.get_by_text(re.compile('executed$|PREEMPTED: '))
        ended.first.wait_for()
        late = 'PREEMPTED' in ended.first.inner_text()
        page.mouse.up()
        if not late:
            return
        assert time.monotonic() < deadline, 'beats are late again and again'


def remove(page: Page, name: str) -> None:
    """Remove an object of the scene, once the page has chosen it."""
    chromium.press(page.locator('button:enabled').filter(has_text=f'Remove {name}'))
    page.get_by_text(f'{name} is removed').wait_for()


def objects(seen: Seen) -> Sequence[CollisionObject]:
    """Return the objects of move_group's scene."""
    request = GetPlanningScene.Request()
    request.components.components = request.components.WORLD_OBJECT_GEOMETRY
    answer = seen.client.call(GetPlanningScene, '/get_planning_scene', request)
    return cast('Sequence[CollisionObject]', answer.scene.world.collision_objects)


def change_scene(seen: Seen, box: CollisionObject) -> None:
    """Change the scene of move_group, as any client does."""
    scene = PlanningScene(is_diff=True)
    scene.robot_state.is_diff = True
    box.header.frame_id = 'panda_link0'
    scene.world.collision_objects.append(box)
    request = ApplyPlanningScene.Request(scene=scene)
    assert seen.client.call(ApplyPlanningScene, '/apply_planning_scene', request).success


@contextmanager
def small_box(seen: Seen, name: str, place: tuple[float, float, float]) -> Iterator[None]:
    """Have a small box in the scene, in no case longer than a block."""
    box = CollisionObject(id=name, operation=CollisionObject.ADD)
    box.primitives.append(SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.1, 0.1, 0.1]))
    at = Point(**dict(zip('xyz', place, strict=True)))
    box.primitive_poses.append(Pose(position=at))
    change_scene(seen, box)
    try:
        yield
    except BaseException:
        change_scene(seen, CollisionObject(id=name, operation=CollisionObject.REMOVE))
        raise


def test_a_dragged_goal_and_a_box(seen: Seen) -> None:
    """Both by the mouse in the scene: the tip goes elsewhere, and the box is where it is left."""
    page = seen.show('Plan')
    chromium.choose(page, 'Goal', DRAGGED)
    chromium.drag_arrow(page, 'green', 40)
    execute(page)
    seen.wait(lambda: seen.way() > 0.05, 'another place')
    press(page, 'Add box')
    page.get_by_text('box1 is added').wait_for()
    chromium.drag_arrow(page, 'red', 30)
    page.get_by_text('box1 is moved').wait_for()
    (box,) = objects(seen)
    assert box.pose != Pose(position=Point(x=0.6, z=0.1)), 'moved or turned'
    remove(page, 'box1')


def test_stop_ends_what_was_planned(seen: Seen) -> None:
    """On its way; what was planned cannot be executed any more."""
    seen.move_to(1.0)
    page = seen.show('Plan')
    chromium.choose(page, 'Goal', 'ready')
    press(page, 'Plan motion')
    page.get_by_text('the motion takes').wait_for()
    chromium.hold(page, HOLD_EXECUTE)
    seen.wait(seen.moves, 'a motion')
    page.keyboard.press('Space')
    seen.wait_for_rest()
    page.mouse.up()
    page.get_by_text(re.compile('PREEMPTED|CONTROL_FAILED')).first.wait_for()
    page.locator('.rv-hold.rv-off').filter(has_text=HOLD_EXECUTE).wait_for()
    assert seen.way() > 0.05


def test_a_goal_is_planned_shown_and_executed(seen: Seen) -> None:
    """A state of the SRDF: blocked by a box first, in the words of move_group, then free."""
    if seen.way() < 0.1:  # no test before has moved it
        seen.move_to(-0.4)
    page = seen.show('Plan')
    with small_box(seen, 'pillar', READY_TIP):
        chromium.choose(page, 'Goal', 'ready')
        press(page, 'Plan motion')
        # where STOP ended the motion before is as near as chance has it
        page.get_by_text(re.compile('(GOAL|START_STATE)_IN_COLLISION: .*pillar')).wait_for()
        page.locator('.rv-hold.rv-off').filter(has_text=HOLD_EXECUTE).wait_for()
        chromium.choose(page, 'Object', 'pillar')
        remove(page, 'pillar')
    press(page, 'Plan motion')
    page.get_by_text('the motion takes').wait_for()
    chromium.picture(page, 'plan')
    assert not seen.moves()
    chromium.hold(page, HOLD_EXECUTE)
    seen.wait(lambda: seen.way() > 0.02 and seen.moves(), 'a motion')
    page.mouse.up()
    page.get_by_text('PREEMPTED').first.wait_for()
    seen.wait_for_rest()
    assert seen.way() > 0.01, 'it was let go on its way'
    execute(page)
    seen.wait(lambda: seen.way() < 0.01, 'the goal')


def test_a_target_moves_the_arm_while_its_button_is_held(seen: Seen) -> None:
    """Its slider moves no joint; another page sees who drives, and only its STOP works."""
    page, other = seen.show('Drive', 'Target'), chromium.open_page(seen.browser, seen.url)
    chromium.picture(page, 'arm')
    chromium.wait_for_colors(page, 100)
    start = seen.position()
    chromium.drag(page, JOINT1, 0.65 if start < 0.0 else 0.35)
    wanted = chromium.slider_value(page, JOINT1)
    assert abs(wanted - start) > 0.3
    seen.wait_for_rest()
    assert abs(seen.position() - start) < 0.001, 'a slider moves the target only'
    chromium.picture(page, 'target')
    chromium.hold(page, HOLD_TARGET)
    seen.wait(lambda: abs(seen.position() - start) > UNDER_WAY, 'a motion')
    other.locator('#rv-who').filter(has_text='another page').wait_for()
    other.locator('body.rv-other').wait_for()
    count = seen.position()
    page.mouse.up()
    seen.wait_for_rest()
    assert abs(seen.position() - wanted) > 0.1, f'let go at {count}'
    chromium.hold(other, '1 +')
    seen.wait_for_rest()
    other.mouse.up()
    chromium.hold(page, HOLD_TARGET)
    seen.wait(seen.moves, 'a motion')
    other.locator('#robot-stop').click(force=True)
    seen.wait_for_rest()
    assert abs(seen.position() - wanted) > 0.05, 'the STOP of another page'
    page.mouse.up()
    for each in (page, other):
        chromium.state_is(each, 'STOPPED')
    other.locator('#rv-take').click(force=True)
    chromium.act(other, ALLOW)
    page.locator('#rv-who').filter(has_text='another page').wait_for()
    other.close()
    page.locator('#rv-who').filter(has_text='nobody').wait_for()


def test_after_stop_nothing_moves_until_it_is_allowed(seen: Seen) -> None:
    """By the space bar, which presses no button; to allow motion moves nothing itself."""
    page = seen.page
    seen.jog(page)
    page.keyboard.press('Space')
    words_of_stop(page, '^stopped$').wait_for()
    chromium.state_is(page, 'STOPPED')
    page.get_by_text(re.compile('^(Stopped|Stand): ')).wait_for()
    seen.wait_for_rest()
    page.mouse.up()
    chromium.picture(page, 'stopped')
    stood = seen.position(WRIST)
    for _ in range(2):
        page.mouse.down()  # the pointer is on the button
        seen.wait_for_rest()
        page.mouse.up()
    chromium.act(page, ALLOW)
    chromium.state_is(page, 'READY')
    seen.wait_for_rest()
    assert abs(seen.position(WRIST) - stood) < 0.001
    seen.jog(page)
    page.mouse.up()
    seen.wait_for_rest()


def test_a_number_counts_when_it_is_complete(seen: Seen) -> None:
    """By Enter, or when its box is left; what is no number goes back to what was shown."""
    page = seen.show('Drive', 'Target')
    seen.move_to(0.0)
    for text, end in (('2.5', ''), ('0,5', 'Tab')):  # longer than what is shown
        seen.type_into(JOINT1, text)
        page.keyboard.press(end or 'Enter')
        assert chromium.slider_value(page, JOINT1) == pytest.approx(float(text.replace(',', '.')))
    seen.type_into(JOINT1, '1e0')
    page.keyboard.press('Enter')
    assert seen.box(JOINT1).input_value() == '0.5', 'no number'
    before = dict(zip(seen.states[-1][1].name, seen.states[-1][1].position, strict=True))
    chromium.hold(page, HOLD_TARGET)
    seen.wait_until_at(0.5)
    page.mouse.up()
    others = set(before) - {'panda_joint1'}
    assert max(abs(seen.position(joint) - before[joint]) for joint in others) < 0.002


def test_a_single_joint_and_the_tool_along_its_own_axes(seen: Seen) -> None:
    """The other joints stand; the tool goes where it points, which is down."""
    page = seen.show('Drive', 'Joints')
    before, start = seen.states[-1][1], seen.position(WRIST)
    chromium.hold(page, '7 −' if seen.position(WRIST) > seen.wrist else '7 +')
    seen.wait(lambda: abs(seen.position(WRIST) - start) > UNDER_WAY, 'a jog')
    page.mouse.up()
    seen.wait_for_rest()
    for name, position in zip(before.name, before.position, strict=True):
        assert name == WRIST or abs(seen.position(name) - position) < MOVES, name
    chromium.show(page, 'Tool')
    chromium.choose(page, 'Along axes of', 'panda_link7')
    chromium.hold(page, 'Z −')
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


def test_a_page_that_crashes_moves_nothing(seen: Seen) -> None:
    """With a button held; it has no time to say so."""
    seen.jog(page := chromium.open_page(seen.browser, seen.url))
    chromium.crash(page)
    seen.wait_for_rest()


def test_a_finger_on_a_phone(seen: Seen) -> None:
    """A swipe moves no joint; a slip does not let go; letting go stops; STOP is below."""
    size = {'width': 390, 'height': 844}
    options: dict[str, Any] = {'viewport': size, 'has_touch': True, 'is_mobile': True}
    page = chromium.open_page(seen.browser, seen.url, **options)
    seen.allow(page)
    button = page.get_by_role('button', name='7 +', exact=True)
    button.scroll_into_view_if_needed()
    box = button.bounding_box()
    assert box is not None
    x, y = box['x'] + box['width'] / 2, box['y'] + box['height'] / 2
    touch = page.context.new_cdp_session(page)

    def finger(kind: str, dy: float = 0.0) -> None:
        points = [] if kind == 'touchEnd' else [{'x': x, 'y': y + dy}]
        touch.send('Input.dispatchTouchEvent', {'type': kind, 'touchPoints': points})

    stood = seen.position(WRIST)
    swipe = {'x': x, 'y': y, 'yDistance': -100, 'speed': 1000, 'gestureSourceType': 'touch'}
    touch.send('Input.synthesizeScrollGesture', swipe)  # in 100 ms, however busy the machine is
    seen.wait_for_rest()
    assert abs(seen.position(WRIST) - stood) < 0.002, 'a swipe moves no joint'
    button.scroll_into_view_if_needed()
    box = button.bounding_box()
    assert box is not None
    y = box['y'] + box['height'] / 2
    finger('touchStart')
    seen.wait(seen.moves, 'a jog')
    finger('touchMove', 40.0)
    page.get_by_text('7 + is held on a page').wait_for()
    slipped = seen.position(WRIST)
    seen.wait(lambda: abs(seen.position(WRIST) - slipped) > UNDER_WAY, 'on and on')
    finger('touchEnd')
    seen.wait_for_rest()
    chromium.picture(page, 'phone')
    stop = page.locator('#robot-stop')
    stop.tap(force=True)
    chromium.state_is(page, 'STOPPED')
    words_of_stop(page, '^stopped$').wait_for()
    page.context.close()


def test_a_fault_has_two_presses_to_motion(seen: Seen) -> None:
    """Seen wherever one is, with its reason; Recover, and a button is held."""
    page = seen.show('Drive', 'Joints')
    request = InjectFault.Request(device='panda_joint3', fault='over_current')
    answer = seen.client.call(InjectFault, '/fake_slaves/fault', request)
    assert answer.success, answer.message
    page.set_default_timeout(SOON)
    chromium.state_is(page, 'FAULT')
    chromium.see_fault(page, 'panda_joint3.*over current', 'Recover panda_joint3')
    chromium.show(page, 'Drive', 'Joints')
    chromium.hold(page, '3 +')
    seen.wait_for_rest()
    page.mouse.up()
    chromium.picture(page, 'fault')
    chromium.act(page, 'Recover panda_joint3')
    chromium.state_is(page, 'READY')
    start = seen.position(WRIST)
    chromium.hold(page, '7 −' if start > seen.wrist else '7 +')
    seen.wait(lambda: abs(seen.position(WRIST) - start) > UNDER_WAY, 'a jog')
    page.mouse.up()
    seen.wait_for_rest()
    page = seen.show('Diagnose')
    page.set_default_timeout(chromium.PAGE_TIMEOUT)
    page.get_by_label('Drive', exact=True).click(force=True)
    page.get_by_role('option', name='/panda_joint3', exact=True).click(force=True)
    page.get_by_role('cell', name='Operation enabled', exact=True).wait_for()


def test_a_robot_that_stops_late(seen: Seen) -> None:
    """The warning gives way to its answer, however often STOP was pressed until then.

    One that was pressed without contact is said to be lost when contact is back.
    """
    answers, stands = list[Future[Stop]](), threading.Event()
    answer = Stop(stands=True, text='stopped: legs')

    def stop() -> Future[Stop]:
        answers.append(Future())
        if stands.is_set():
            answers[-1].set_result(answer)
        return answers[-1]

    def show() -> None:
        while not over.wait(0.2):  # of a page that says nothing the overlay says NO CONTACT
            if silent.is_set():
                continue
            stage = 'stopped' if stands.is_set() else 'braking' if answers else ''
            state = RobotState('READY', Level.WELL, '')
            of = {'program': '', 'listens': '', 'namespace': ''}
            served.show_state(state, {}, cast(Overlay, {'stop': stage, 'simulated': True, **of}))

    over, silent = threading.Event(), threading.Event()
    with (
        closing(RobotPage('127.0.0.1', 8600, cast(Actions, SimpleNamespace(stop=stop)))) as served,
        ThreadPoolExecutor() as threads,
    ):
        threads.submit(show)
        try:
            page = chromium.open_page(seen.browser, served.url, robot='')
            other = chromium.open_page(seen.browser, served.url, robot='')
            words_of_stop(page, 'Space').wait_for()
            silent.set()
            words_of_stop(page, 'does NOT reach the robot').wait_for()
            page.route('**/stop', lambda route: route.abort())
            with page.expect_event('requestfailed'):
                page.keyboard.press('Space')
            words_of_stop(page, 'does NOT reach the robot').wait_for()
            silent.clear()
            words_of_stop(page, 'the last STOP was NOT received').wait_for()
            page.unroute('**/stop')
            for _ in range(9):  # more than a browser sends at once
                page.keyboard.press('Space')
            words_of_stop(page, 'NOT confirmed: use the emergency stop').wait_for()
            words_of_stop(other, 'NOT confirmed: use the emergency stop').wait_for()
            count = len(answers)
            page.keyboard.press('Space')
            seen.wait(lambda: len(answers) > count, 'a STOP behind those that are not answered')
            stands.set()
            for each in answers:
                if not each.done():
                    each.set_result(answer)
            words_of_stop(page, '^stopped$').wait_for()
            words_of_stop(other, '^stopped$').wait_for()
            page.close()
            other.close()
        finally:
            over.set()


def test_a_robot_that_does_not_answer_has_not_stopped(seen: Seen) -> None:
    """Its process hangs, is killed, and the page's own end: the page says what to do."""
    page = seen.show('Diagnose')
    page.get_by_label('Drive', exact=True).click(force=True)  # with a dropdown open
    (robot,) = find_children(seen.bringup.pid, '/motion_node')
    robot.suspend()
    try:
        page.keyboard.press('Space')
        words_of_stop(page, 'NOT confirmed: use the emergency stop').wait_for()
        chromium.state_is(page, 'NO CONTACT WITH THE ROBOT')
    finally:
        with suppress(psutil.NoSuchProcess):
            robot.resume()
    words_of_stop(page, 'stopped|NOT confirmed').wait_for()
    page.keyboard.press('Escape')
    robot.kill()
    page.set_default_timeout(SOON)
    chromium.state_is(page, 'NO CONTACT WITH THE ROBOT')
    page.evaluate(WORDS_OF_STOP)
    page.keyboard.press('Space')
    words_of_stop(page, 'NOT confirmed: use the emergency stop').wait_for()
    assert 'stopped' not in page.evaluate('window.said')
    page.get_by_text(re.compile('✓ .*: (drive|bus)$')).first.wait_for(state='hidden')
    assert not page.locator('.well:visible').count(), 'nothing is green'
    chromium.show(page, 'Drive')
    page.locator('.rv-hold:visible').first.wait_for()
    assert not page.evaluate(chromium.ACTIVE)
    psutil.Process(seen.viewer.pid).kill()
    chromium.state_is(page, 'NO CONTACT$')
    words_of_stop(page, 'does NOT reach the robot').wait_for()
    for _ in range(4):
        page.wait_for_event('websocket')  # it tries again and again
    chromium.state_is(page, 'NO CONTACT$')
    words_of_stop(page, 'does NOT reach the robot').wait_for()
    assert not page.evaluate(chromium.ACTIVE)
    chromium.picture(page, 'no-contact')
