# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page at four sizes: STOP in reach, nothing moves, and what a finger and an eye need.

The page is real, in a real browser; what it shows of an arm comes from here.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import closing
from dataclasses import dataclass, field, replace
from itertools import combinations
import re
import threading
from types import SimpleNamespace
from typing import Any, cast, TYPE_CHECKING

import browser as chromium
from browser import ACTIVE, SIZES
from manual_page import CHECKOUT
import pytest
from urdf_reader import read_urdf

from arm_model import example_files
from robot_viewer.page.jog_panel import Actions, Offered
from robot_viewer.page.robot_page import RobotPage
from robot_viewer.robot_state import ALLOW, Level, RobotState, Stop

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytestmark = [
    pytest.mark.scenario,
    pytest.mark.timeout(300),
    pytest.mark.skipif(bool(chromium.lacking()), reason=chromium.lacking()),
]

PHONES = {'phone', 'short'}
GROUPS = ['Drive', 'Plan', 'See', 'Diagnose']
JOG_BUTTONS = 14
READY = RobotState('READY', Level.WELL, 'Hold a button to move.')
STATES = (
    READY,
    RobotState('FAULT', Level.FAULT, 'panda_joint3: over current. ' * 9, 'Recover panda_joint3'),
    RobotState('STOPPED', Level.ACT, 'Stopped: panda_joint2.', ALLOW),
    RobotState('AT A LIMIT', Level.WARNING, 'panda_joint2 is at its upper limit (1.76 rad).'),
    RobotState('NO CONTACT WITH THE ROBOT', Level.UNKNOWN, 'Nothing for 12 s.'),
)
LONG = 'all drives: ' + 'panda_joint3: 0x2310 continuous over current at output; ' * 11
TOUCHED = '#robot-stop, #rv-view button, .rv-hold, .mantine-Button-root, [role=tab]'
IS_STOP = '([x, y]) => document.elementFromPoint(x, y).closest("#robot-stop") !== null'
BOXES = """selector => Object.fromEntries([...document.querySelectorAll(selector)].map(e =>
  [e.innerText, e.getBoundingClientRect()]).filter(([, b]) => b.width > 0).map(([text, b], n) =>
  [n + text, [b.left, b.top, b.width, b.height]]))"""
PICTURE_FITS = """() => [...document.querySelectorAll('canvas')].every(canvas => {
  const [one, two] = [canvas, canvas.parentElement].map(e => e.getBoundingClientRect());
  return one.width === two.width && one.height === two.height; })"""
CONTRASTS = """() => {
  const part = v => (v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const light = c => 0.2126 * part(c[0]) + 0.7152 * part(c[1]) + 0.0722 * part(c[2]);
  const ratio = (a, b) => (Math.max(a, b) + 0.05) / (Math.min(a, b) + 0.05);
  const numbers = text => text.match(/[\\d.]+/g).map(Number);
  const back = e => { for (; e; e = e.parentElement) {
    const c = numbers(getComputedStyle(e).backgroundColor);
    if (c.length < 4 || c[3] > 0.5) return c; }
    return [255, 255, 255]; };
  const found = [];
  const read = '#rv-bar *, #rv-view *, #rv-foot *, .rv-hold, .rv-cell *, .mantine-Button-root';
  for (const e of document.querySelectorAll(read)) {
    const b = e.getBoundingClientRect();
    const seen = document.elementFromPoint(b.left + b.width / 2, b.top + b.height / 2);
    if (!e.innerText?.trim() || !(e.contains(seen) || seen?.matches('button'))) continue;
    const [one, two] = [light(numbers(getComputedStyle(e).color)), light(back(e))];
    if (ratio(one, two) < 4.5) found.push([e.innerText, ratio(one, two)]);
  }
  const edged = '.rv-hold, #rv-view button, .mantine-Button-root, .mantine-Input-input';
  for (const e of document.querySelectorAll(`${edged}, .rv-cell i, .mantine-Slider-track`)) {
    const [style, bar] = [getComputedStyle(e), getComputedStyle(e, '::before')];
    const edge = e.matches('.mantine-Slider-track') ? bar.backgroundColor
      : /rgb[^)]*\\)/.exec(style.boxShadow)?.[0] ?? style.borderTopColor;
    const shape = ratio(light(numbers(edge)), light(back(e.parentElement)));
    if (e.offsetParent && shape < 3) found.push([e.className, shape]);
  }
  return found;
}"""
REDS = """() => [...document.querySelectorAll('body *')].filter(e => {
  const b = e.getBoundingClientRect();
  if (!b.width || !b.height || e.closest('#robot-stop, canvas, svg, [role=dialog]')) return false;
  return [getComputedStyle(e).backgroundColor, getComputedStyle(e).color].some(text => {
    const [r, g, b, a] = [...text.match(/[\\d.]+/g).map(Number), 1];
    return a > 0.1 && r > 120 && r > 1.8 * Math.max(g, b); });
}).map(e => e.outerHTML.slice(0, 120))"""


@dataclass
class Shown:
    """A page of an arm that is shown in any state."""

    page: RobotPage  # what is served
    state: RobotState = READY  # what it shows, again and again
    stops: int = 0  # how often STOP was pressed
    jogs: list[tuple[object, ...]] = field(default_factory=list)  # what was jogged
    offered: Offered = field(default_factory=Offered)  # what can be driven

    def show(self, over: threading.Event) -> None:
        """Show it until the end."""
        while not over.wait(0.1):
            self.page.show_state(
                self.state,
                {f'panda_joint{number}': 0.1 * number for number in range(1, 8)},
                {
                    'stop': 'stopped' if self.state.word == 'STOPPED' else '',
                    'simulated': True,
                    'program': '',
                    'listens': '',
                    'namespace': '',
                },
            )
            self.page.list_log()


@pytest.fixture(scope='module')
def browser() -> Iterator[Browser]:
    """Start a browser."""
    with chromium.browser() as started:
        yield started


@pytest.fixture(scope='module')
def shown() -> Iterator[Shown]:
    """Serve the page of an arm."""

    def stop() -> Future[Stop]:
        answer: Future[Stop] = Future()
        answer.set_result(Stop(stands=True, text='stopped: panda_joint2'))
        made.stops += 1
        return answer

    def jog(*what: object) -> None:
        made.jogs.append(what)

    actions: Any = SimpleNamespace(stop=stop, jog_joint=jog, jog=jog, aim=print, let_go=print)
    with closing(RobotPage('127.0.0.1', 8650, cast(Actions, actions))) as page:
        made, over = Shown(page), threading.Event()
        tree = read_urdf(example_files().urdf.read_text())
        page.show_robot(tree)
        arm = tuple(f'panda_joint{number}' for number in range(1, 8))
        made.offered = Offered(arm, True, (('/hand', arm[-1]),), arm)
        page.offer_drive(made.offered)
        page.velocity = lambda share: 0.4 * share
        page.offer_drives({f'/{joint}': ('enable', 'recover', 'halt', 'disable') for joint in arm})
        thread = threading.Thread(target=made.show, args=[over])
        thread.start()
        yield made
        over.set()
        thread.join()


def opened(browser: Browser, shown: Shown, size: str) -> Page:
    """Open the page at a size; what a test that failed has left open would draw on."""
    for context in browser.contexts:
        context.close()
    width, height = SIZES[size]
    return chromium.open_page(
        browser,
        shown.page.url,
        viewport={'width': width, 'height': height},
        has_touch=size != 'desk',
        is_mobile=size in PHONES,
    )


def see(page: Page, shown: Shown, state: RobotState) -> None:
    """Show a state, and wait until the page does."""
    shown.state = state
    chromium.state_is(page, f'{state.word}$')


def boxes(page: Page, selector: str) -> dict[str, list[float]]:
    """Return left, top, width and height of what is seen of a selector."""
    return cast('dict[str, list[float]]', page.evaluate(BOXES, selector))


def overlapping(areas: list[tuple[float, ...]]) -> list[tuple[tuple[float, ...], ...]]:
    """Return pairs of boxes that have more than 1 px in common."""
    return [
        (one, two)
        for one, two in combinations(areas, 2)
        if all(
            min(one[i] + one[i + 2], two[i] + two[i + 2]) - max(one[i], two[i]) > 1 for i in (0, 1)
        )
    ]


def check_reach(page: Page, size: str) -> None:
    """STOP, name, picture and panel are in their places, and nothing overlaps."""
    width, height = SIZES[size]
    (left, top, wide, high), *_ = boxes(page, '#robot-stop').values()
    if size in PHONES:
        assert wide >= 0.9 * width
        assert high >= 60
        assert top >= height - 100
    else:
        assert (left < 20, top < 20) == (True, True)
        assert (wide >= 140, high >= 58) == (True, True)
    middle = [left + wide / 2, top + high / 2]
    assert page.evaluate(IS_STOP, middle)
    name = page.locator('#rv-robot')
    assert (name.inner_text().split(), name.is_visible()) == (['simulated', 'panda'], True)
    page.wait_for_function(PICTURE_FITS)  # viser sizes its two canvases one after the other
    picture = boxes(page, 'canvas')
    x, y, seen, tall = next(iter(picture.values()))
    areas = boxes(page, 'canvas, #rv-bar, #rv-foot, .mantine-Paper-root:has([role=tab])')
    assert not overlapping(list(dict.fromkeys(map(tuple, areas.values()))))
    if size in PHONES:
        assert (seen >= 390, tall >= 200) == (True, True)
        assert boxes(page, '.mantine-Paper-root:has([role=tab])').popitem()[1][2] == width, (
            'the panel'
        )
        assert (
            page.evaluate(
                '([x, y]) => document.elementFromPoint(x, y).tagName', [x + seen / 2, y + tall / 2]
            )
            == 'CANVAS'
        )


@pytest.mark.parametrize('size', SIZES)
def test_stop_is_in_reach_and_nothing_overlaps_or_moves(
    browser: Browser, shown: Shown, size: str
) -> None:
    """In each group and state, with an answer of 600 characters."""
    page = opened(browser, shown, size)
    see(page, shown, READY)
    assert page.locator('[role=tab]').all_inner_texts()[:4] == GROUPS
    for group in GROUPS:
        chromium.show(page, group)
        check_reach(page, size)
    chromium.show(page, 'Drive')
    page.locator('.rv-hold:visible').nth(JOG_BUTTONS - 1).wait_for()
    before = boxes(page, '#robot-stop, .rv-hold, [role=tab], #rv-view button')
    assert len([name for name in before if name.endswith(('−', '+'))]) >= JOG_BUTTONS
    for state in STATES:
        shown.page.say(LONG, failed=True)
        see(page, shown, state)
        after = boxes(page, '#robot-stop, .rv-hold, [role=tab], #rv-view button')
        moved = {
            name: (box, after.get(name))
            for name, box in before.items()
            if 'STOP' not in name  # its words change
            and max(abs(a - b) for a, b in zip(box, after.get(name, [9e9] * 4), strict=True)) > 1
        }
        assert not moved, state.word
        assert not page.evaluate(CONTRASTS), state.word
        assert page.locator('#rv-do').is_visible() is bool(state.action), state.word
        assert bool(page.evaluate(ACTIVE)) is state.movable, state.word
    see(page, shown, READY)
    shown.page.say('done')
    page.locator('#rv-foot').filter(has_text='done').wait_for(state='attached')
    assert not page.evaluate(REDS)
    if size != 'desk':
        touched = boxes(page, TOUCHED).items()
        small = {name: box for name, box in touched if min(box[2:]) < 43.5}
        assert not small
        holds = boxes(page, '.rv-hold').values()
        assert not overlapping([(x - 3.9, y - 3.9, w + 7.8, h + 7.8) for x, y, w, h in holds])
    if size not in PHONES:
        tab = boxes(page, '[role=tab]')
        x, y, *_ = next(iter(tab.values()))
        page.mouse.move(x + 10, y + 10)
        page.mouse.down()
        page.mouse.move(x - 300, y + 200, steps=5)
        page.mouse.up()
        assert boxes(page, '[role=tab]') == tab, 'a tab is not torn out'


def test_the_groups_are_in_their_order_from_the_first_second(browser: Browser) -> None:
    """In five starts of the page, without a robot and with one."""
    actions = cast(Actions, SimpleNamespace(stop=print))
    for _ in range(5):
        with closing(RobotPage('127.0.0.1', 8650, actions)) as served:
            page = chromium.open_page(browser, served.url, robot='')
            tabs = page.locator('[role=tab]')
            assert tabs.all_inner_texts() == GROUPS
            served.show_robot(read_urdf(example_files().urdf.read_text()))
            tabs.filter(has_text='Joints').wait_for()
            assert tabs.all_inner_texts()[: len(GROUPS)] == GROUPS
            page.close()


def test_stop_is_in_reach_of_what_viser_opens(browser: Browser, shown: Shown) -> None:
    """Above a dialogue and a notification, on each size."""
    see(page := opened(browser, shown, 'desk'), shown, READY)
    (client,) = shown.page.server.get_clients().values()
    client.add_notification('a notification', 'of viser')
    with client.gui.add_modal('a dialogue of viser'):
        client.gui.add_button('close')
    page.get_by_text('a dialogue of viser').wait_for()
    for width, height in SIZES.values():
        page.set_viewport_size({'width': width, 'height': height})
        ((left, top, wide, high),) = boxes(page, '#robot-stop').values()
        assert page.evaluate(IS_STOP, [left + wide / 2, top + high / 2]), (width, height)


def test_keys_move_the_robot_where_that_is_ticked(browser: Browser, shown: Shown) -> None:
    """Those of the terminal program, as long as they are held; what is typed moves nothing."""
    see(page := opened(browser, shown, 'desk'), shown, READY)
    chromium.show(page, 'Drive')
    held = page.locator('.rv-held')
    shown.jogs.clear()
    page.keyboard.press('ArrowUp', delay=400)
    assert not shown.jogs, 'it is not ticked'
    page.locator('.rv-speed input').check(force=True)
    x = (0.2, 0.0, 0.0, 0.0, 0.0, 0.0), ''
    for key, jog in (('ArrowUp', x), ('3', ('panda_joint3', 0.2)), ('3', ('panda_joint3', -0.2))):
        shown.jogs.clear()
        page.keyboard.down(key)
        held.first.wait_for(state='attached')
        page.wait_for_timeout(200)
        page.keyboard.down('r')  # any other key lets go; this one turns the direction of joints
        held.first.wait_for(state='detached')
        page.keyboard.up('r')
        page.keyboard.up(key)
        assert set(shown.jogs[:-1]) == {jog}
        if key == 'ArrowUp':
            page.keyboard.press('r')
    for other in ('Control', 'Tab'):
        page.keyboard.down('ArrowUp')
        held.first.wait_for(state='attached')
        page.keyboard.down(other)
        held.first.wait_for(state='detached')
        page.keyboard.up(other)
        page.keyboard.up('ArrowUp')
    shown.jogs.clear()
    page.locator('input[inputmode=decimal]:visible').first.click(force=True)
    page.keyboard.press('3', delay=400)
    assert not shown.jogs, 'a number is typed'
    assert page.locator('.rv-speed span').inner_text() == 'Tool: 80 mm/s'


def test_what_is_offered_later_takes_no_open_tab_away(browser: Browser, shown: Shown) -> None:
    """In the first seconds of a robot it comes piece by piece; a target that is set stays, too."""
    shown.page.offer_drive(Offered(targets=shown.offered.targets))
    see(page := opened(browser, shown, 'desk'), shown, READY)
    chromium.show(page, 'Drive', 'Target')
    chromium.drag(page, 1, 0.7)
    target = chromium.slider_value(page, 1)
    for tab, offered in (('Target', replace(shown.offered, tool=False)), ('Tool', shown.offered)):
        chromium.show(page, 'Drive', tab)
        shown.page.offer_drive(offered)
        last = 'X +' if offered.tool else '7 +'
        page.locator('.rv-keyed').get_by_text(last, exact=True).wait_for(state='attached')
        selected = page.locator('[role=tab][aria-selected=true]').all_inner_texts()
        assert selected == ['Drive', tab]
    page.get_by_role('button', name='X +', exact=True).wait_for()
    chromium.show(page, 'Drive', 'Target')
    page.locator(f'[role=slider][aria-valuenow="{target}"]').wait_for()


def test_the_log_is_copied_as_text(browser: Browser, shown: Shown) -> None:
    """All of it, the last entry first."""
    see(page := opened(browser, shown, 'desk'), shown, READY)
    page.context.grant_permissions(['clipboard-read'])
    chromium.show(page, 'Diagnose')
    shown.page.say('first')
    shown.page.say('<second>')
    page.get_by_text('<second>').last.wait_for()
    chromium.press(page.locator('.rv-copy'))
    page.get_by_text('Log is copied').wait_for()
    copied = str(page.evaluate('navigator.clipboard.readText()')).splitlines()
    assert copied[1:4:2] == ['<second>', 'first']


@pytest.mark.parametrize('size', SIZES)
def test_control_is_taken_by_a_button_that_is_seen_whole(
    browser: Browser, shown: Shown, size: str
) -> None:
    """Where another page has it."""
    see(page := opened(browser, shown, size), shown, READY)
    other = chromium.open_page(browser, shown.page.url)
    chromium.hold(other, '1 +')
    page.locator('#rv-who').filter(has_text='another page').wait_for()
    other.mouse.up()
    page.locator('#rv-take').wait_for()
    ((x, y, wide, high),) = boxes(page, '#rv-take').values()
    assert min(wide, high) >= 43.5
    for corner in ([x + 4, y + 4], [x + wide - 4, y + high - 4]):
        assert page.evaluate('([x, y]) => document.elementFromPoint(x, y).id', corner) == 'rv-take'
    page.locator('#rv-take').click(force=True)
    page.locator('#rv-who').filter(has_text='you').wait_for()


@pytest.mark.parametrize('size', ['desk', 'phone'])
def test_a_press_of_a_button_that_does_nothing_says_why(
    browser: Browser, shown: Shown, size: str
) -> None:
    """The state of the robot, or what is wanted first; STOP stays in reach."""
    page = opened(browser, shown, size)
    chromium.show(page, 'Drive')
    jog = page.locator('.rv-hold:visible').first
    why = page.locator('#rv-why')
    for state, reason in ((STATES[1], 'over current'), (READY, 'Press Walk first.')):
        if state is READY:
            number = int(jog.get_attribute('data-hold') or 0)
            shown.page.live.off[number] = reason
            page.locator('.rv-off').first.wait_for()
        see(page, shown, state)
        jog.dispatch_event('pointerdown', {'button': 0})
        why.filter(has_text=f'1 −: {reason}' if state is READY else reason).wait_for()
        low, stop = boxes(page, '#rv-why'), boxes(page, '#robot-stop')
        ((_, top, _, high),), ((_, above, _, _),) = low.values(), stop.values()
        assert size == 'desk' or top + high <= above
    shown.page.live.off.clear()
    why.wait_for(state='hidden')
    chromium.show(page, 'Drive', 'Gripper')
    open_it = page.get_by_role('button', name='Open gripper', exact=True)
    for state in STATES:
        see(page, shown, state)
        page.locator(f'button:{"enabled" if state.movable else "disabled"}').filter(
            has_text='Open gripper'
        ).wait_for()
        if not state.movable:
            chromium.press(open_it)
            why.filter(has_text=f'Open gripper: {state.sentence.strip()}').wait_for()


@pytest.mark.parametrize('size', ['desk', 'phone', 'short'])
def test_the_card_has_the_commands_of_the_readme(
    browser: Browser, shown: Shown, size: str
) -> None:
    """Where there is no robot, it says what to type, and goes by itself."""
    page = opened(browser, shown, size)
    see(page, shown, RobotState('NO ROBOT', Level.UNKNOWN, 'No robot is here yet.'))
    card = page.locator('#rv-first')
    card.wait_for()
    whole = 'all => all.every(code => code.scrollWidth <= code.clientWidth)'
    assert card.locator('code').evaluate_all(whole), 'a command is cut off'
    assert not overlapping([*map(tuple, boxes(page, '#rv-first, #rv-who, #robot-stop').values())])
    commands = card.locator('code').all_inner_texts()
    assert len(commands) == 4
    readmes = ''.join(path.read_text() for path in CHECKOUT.glob('*/README.md'))
    manual = re.sub(r'\s+', ' ', readmes + (CHECKOUT / 'README.md').read_text())
    for command in commands:
        assert command in manual, command
    see(page, shown, READY)
    card.wait_for(state='hidden')
