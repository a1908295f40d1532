# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The page at four sizes: STOP in reach, nothing moves, and what a finger and an eye need.

The page is real, in a real browser; what it shows of an arm comes from here.
"""

from __future__ import annotations

from collections.abc import Iterator
from concurrent.futures import Future
from contextlib import closing
from dataclasses import dataclass
import re
import threading
from types import SimpleNamespace
from typing import Any, cast, TYPE_CHECKING

import browser as chromium
from manual_page import CHECKOUT
import pytest
from urdf_reader import read_urdf

from arm_model import example_files
from robot_viewer.page.jog_panel import Offered
from robot_viewer.page.robot_page import Actions, RobotPage
from robot_viewer.robot_state import ALLOW, Level, RobotState, Stop

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytestmark = [
    pytest.mark.scenario,
    pytest.mark.timeout(300),
    pytest.mark.skipif(bool(chromium.lacking()), reason=chromium.lacking()),
]

SIZES = {'desk': (1440, 900), 'tablet': (1024, 768), 'phone': (390, 844), 'short': (390, 664)}
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
BOXES = """selector => Object.fromEntries([...document.querySelectorAll(selector)].map(e =>
  [e.innerText, e.getBoundingClientRect()]).filter(([, b]) => b.width > 0).map(([text, b], n) =>
  [n + text, [b.left, b.top, b.width, b.height]]))"""
CONTRASTS = """() => {
  const part = v => (v /= 255) <= 0.03928 ? v / 12.92 : ((v + 0.055) / 1.055) ** 2.4;
  const light = c => 0.2126 * part(c[0]) + 0.7152 * part(c[1]) + 0.0722 * part(c[2]);
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
    const ratio = (Math.max(one, two) + 0.05) / (Math.min(one, two) + 0.05);
    if (ratio < 4.5) found.push([e.innerText, ratio]);
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
    """A page of an arm that is shown in any state.

    Attributes:
        page: What is served.
        state: What it shows, again and again.
        stops: How often STOP was pressed.
    """

    page: RobotPage
    state: RobotState = READY
    stops: int = 0

    def show(self, over: threading.Event) -> None:
        """Show it until the end."""
        while not over.wait(0.1):
            self.page.show_state(
                self.state,
                {f'panda_joint{number}': 0.1 * number for number in range(1, 8)},
                stop='stopped' if self.state.word == 'STOPPED' else '',
                simulated=True,
                program='',
                listens='',
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

    actions: Any = SimpleNamespace(stop=stop, jog_joint=print, jog=print, aim=print, let_go=print)
    with closing(RobotPage('127.0.0.1', 8650, cast(Actions, actions))) as page:
        made, over = Shown(page), threading.Event()
        tree = read_urdf(example_files().urdf.read_text())
        page.show_robot(tree)
        arm = tuple(f'panda_joint{number}' for number in range(1, 8))
        page.offer_drive(Offered(arm, True, (), arm))
        page.offer_drives({f'/{joint}': ('enable', 'recover', 'halt', 'disable') for joint in arm})
        thread = threading.Thread(target=made.show, args=[over])
        thread.start()
        yield made
        over.set()
        thread.join()


def opened(browser: Browser, shown: Shown, size: str) -> Page:
    """Open the page at a size."""
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


@pytest.mark.parametrize('size', SIZES)
def test_stop_is_in_reach_and_nothing_overlaps_or_moves(
    browser: Browser, shown: Shown, size: str
) -> None:
    """In each group and state, with an answer of 600 characters."""
    page = opened(browser, shown, size)
    width, height = SIZES[size]
    see(page, shown, READY)
    assert page.locator('[role=tab]').all_inner_texts()[:4] == GROUPS
    for group in GROUPS:
        chromium.show(page, group)
        (left, top, wide, high), *_ = boxes(page, '#robot-stop').values()
        if size in PHONES:
            assert wide >= 0.9 * width
            assert high >= 60
            assert top >= height - 100
        else:
            assert (left < 20, top < 20) == (True, True)
            assert (wide >= 140, high >= 58) == (True, True)
        middle = [left + wide / 2, top + high / 2]
        at = '([x, y]) => document.elementFromPoint(x, y).closest("#robot-stop") !== null'
        assert page.evaluate(at, middle)
        picture = boxes(page, 'canvas')
        x, y, seen, tall = next(iter(picture.values()))
        if size in PHONES:
            assert (seen >= 390, tall >= 200) == (True, True)
            assert (
                page.evaluate(
                    '([x, y]) => document.elementFromPoint(x, y).tagName',
                    [x + seen / 2, y + tall / 2],
                )
                == 'CANVAS'
            )
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
    see(page, shown, READY)
    shown.page.say('done')
    page.locator('#rv-foot').filter(has_text='done').wait_for(state='attached')
    assert not page.evaluate(REDS)
    if size != 'desk':
        touched = boxes(page, TOUCHED).items()
        small = {name: box for name, box in touched if min(box[2:]) < 43.5}
        assert not small
    if size not in PHONES:
        tab = boxes(page, '[role=tab]')
        x, y, *_ = next(iter(tab.values()))
        page.mouse.move(x + 10, y + 10)
        page.mouse.down()
        page.mouse.move(x - 300, y + 200, steps=5)
        page.mouse.up()
        assert boxes(page, '[role=tab]') == tab, 'a tab is not torn out'
    page.close()


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
    page.close()


def test_the_card_has_the_commands_of_the_readme(browser: Browser, shown: Shown) -> None:
    """Where there is no robot, it says what to type, and goes by itself."""
    page = opened(browser, shown, 'desk')
    see(page, shown, RobotState('NO ROBOT', Level.UNKNOWN, 'No robot is here yet.'))
    card = page.locator('#rv-first')
    card.wait_for()
    commands = card.locator('code').all_inner_texts()
    assert len(commands) == 4
    readmes = ''.join(path.read_text() for path in CHECKOUT.glob('*/README.md'))
    manual = re.sub(r'\s+', ' ', readmes + (CHECKOUT / 'README.md').read_text())
    for command in commands:
        assert command in manual, command
    see(page, shown, READY)
    card.wait_for(state='hidden')
    page.close()
