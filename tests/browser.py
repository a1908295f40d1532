# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A real browser on the page of a robot."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
import importlib.util
import io
import os
from pathlib import Path
import re
import shlex
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from typing import TYPE_CHECKING

import numpy as np
from processes import find_children
import psutil

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Locator, Page
    from processes import RunningProcess

NAMES = ('chromium', 'chromium-browser', 'google-chrome')
"""What distributions call it."""
OPTIONS = [
    '--no-sandbox',  # in containers the tests are root
    '--use-angle=swiftshader',  # WebGL without a graphics card
    '--enable-unsafe-swiftshader',
    '--ignore-gpu-blocklist',
]
POLITE = ('nice', '-n', '5')
"""It draws without a graphics card; the robots that it shows come first."""
UNPRIVILEGED = ('setpriv', '--bounding-set=-sys_nice')
"""As root a browser would have the process that draws at nice -8, before the robots."""
SIZE = {'width': 820, 'height': 560}  # [px] a software renderer draws it
SIZES = {'desk': (1440, 900), 'tablet': (1024, 768), 'phone': (390, 844), 'short': (390, 664)}
"""Width and height in [px] for which the page is made."""
PAGE_TIMEOUT = 60_000  # [ms] on a busy machine
TEXT_TIMEOUT = 5_000  # [ms] of a page that may hang
PAGE_URL = r'the robot is seen at (http://localhost:\d+)$'
"""What a bring-up or demo prints of its page."""
FEW_PICTURES = """
const draw = window.requestAnimationFrame.bind(window);
window.requestAnimationFrame = (act) => setTimeout(() => draw(act), 200);
"""
"""A page draws a few times a second: without a graphics card the robot needs the processor."""
DRAWN_ON_DEMAND = """
for (const kind of [WebGLRenderingContext, WebGL2RenderingContext])
  for (const name of ['clear', 'drawArrays', 'drawElements', 'drawArraysInstanced',
                      'drawElementsInstanced', 'drawRangeElements', 'blitFramebuffer']) {
    const real = kind.prototype[name];
    if (real) kind.prototype[name] = function (...values) {
      if (window.drawn) real.apply(this, values);
    };
  }
"""
"""Pixels of the scene are drawn where a test looks at them: one picture costs a core a second."""
TWO_PICTURES = """() => new Promise(
  (done) => requestAnimationFrame(() => requestAnimationFrame(done)))"""
REACHED = """element => {
  const box = element.getBoundingClientRect();
  return element.contains(
    document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2));
}"""
"""Whether a click on the middle of an element reaches it."""
IN_SIGHT = f"""element => {{
  element.scrollIntoViewIfNeeded();
  return ({REACHED})(element);
}}"""
"""A folder that is still folded out hides what has its place already."""
PICTURES = Path(__file__).parents[1] / 'build' / 'screenshots'
"""Where pictures of the tests are kept, to be looked at."""
PANEL = 410  # [px] width of the controls at the right
TOP = 80  # [px] height of STOP and state
BELOW = 100  # [px] height of views and messages
STANDS = 200  # [ms] in one place
NEAR = 0.02  # share of a slider's way from where it was dragged to
GROUPS = 4  # tabs of each page
ACTIVE = """() => [...document.querySelectorAll('.rv-hold:not(.rv-always)')].filter(hold =>
  getComputedStyle(hold).cursor !== 'not-allowed').map(hold => hold.innerText)"""
"""Buttons that would move the robot."""


_started: list[Browser] = []


def url_of(robot: RunningProcess, timeout: float) -> str:
    """Wait for the URL of the page that a bring-up or demo prints, and return it.

    Args:
        robot: The bring-up or demo.
        timeout: Longest time in [s].
    """
    return robot.wait_for(PAGE_URL, timeout).rpartition(' ')[2]


def viewers_below(robot: RunningProcess) -> list[psutil.Process]:
    """Return the processes that serve the page of a bring-up or demo."""
    return find_children(robot.pid, '/web_viewer')


def lacking() -> str:
    """Return why there is no browser; empty where there is one."""
    if importlib.util.find_spec('playwright') is None:
        return 'needs playwright (make test installs it)'
    if not any(map(shutil.which, NAMES)):
        return f'needs a browser: one of {", ".join(NAMES)}'
    return ''


@contextmanager
def browser(prefix: Sequence[str] = ()) -> Iterator[Browser]:
    """Start one, without a window.

    Args:
        prefix: Command that runs it, as on another host; none to run it here.
    """
    from playwright.sync_api import sync_playwright

    with sync_playwright() as playwright, tempfile.TemporaryDirectory() as folder:
        script = Path(folder, NAMES[0])
        command = shlex.join([*prefix, *_polite(), _program()])
        script.write_text(f'#!/bin/sh\nexec {command} "$@"\n')
        script.chmod(0o700)
        started = playwright.chromium.launch(executable_path=script, args=OPTIONS)
        _started.append(started)
        try:
            yield started
        except BaseException:
            sys.stderr.write('\n'.join(texts()))  # pytest shows it with the failure
            raise
        finally:
            _started.remove(started)
            started.close()


def _polite() -> tuple[str, ...]:
    """Return the command that starts a program politely, as far as it can here."""
    if shutil.which(UNPRIVILEGED[0]) is None:
        return POLITE
    tried = subprocess.run([*UNPRIVILEGED, 'true'], check=False, capture_output=True)
    return POLITE if tried.returncode else (*UNPRIVILEGED, *POLITE)


def crash(page: Page) -> None:
    """End the process of a page: it has no time to say so."""
    from playwright.sync_api import Error

    with suppress(Error):  # it never arrives there
        page.goto('chrome://crash')


def _program() -> str:
    return next(filter(None, map(shutil.which, NAMES)))


def processes() -> list[psutil.Process]:
    """Return those of all browsers that this process has started."""
    children = psutil.Process().children(recursive=True)
    return [child for child in children if 'chrom' in child.name()]


@contextmanager
def asleep() -> Iterator[None]:
    """Stop the browser as a laptop that is closed does."""
    stopped = processes()
    for process in stopped:
        process.send_signal(signal.SIGSTOP)
    try:
        yield
    finally:
        for process in stopped:
            process.send_signal(signal.SIGCONT)


def open_page(
    browser: Browser, url: str, *, robot: str = '.', drawn: bool = False, **options: object
) -> Page:
    """Open a page and wait until it shows its groups, and the name of a robot that matches.

    Args:
        browser: The browser.
        url: Of the page.
        robot: Regular expression.
        drawn: The scene is drawn all the time, not only where a test looks at it.
        options: Of playwright.
    """
    page = browser.new_page(**({'viewport': SIZE} | options))  # type: ignore[arg-type]
    page.set_default_timeout(3 * PAGE_TIMEOUT)  # its program is compiled
    page.add_init_script(FEW_PICTURES + DRAWN_ON_DEMAND)
    page.add_init_script(f'window.drawn = {str(drawn).lower()}')
    page.goto(url, wait_until='commit')  # what it shows counts
    # viser's own warning of a software renderer covers the scene
    page.add_style_tag(content='.mantine-Notifications-root { display: none }')
    page.locator('#rv-robot b').filter(has_text=re.compile(robot)).wait_for(state='attached')
    page.locator('[role=tab]').nth(GROUPS - 1).wait_for()  # by another connection, maybe later
    page.set_default_timeout(PAGE_TIMEOUT)
    return page


def texts() -> Iterator[str]:
    """Yield the console output of open pages, which shows the cause of a failure."""
    for started in _started:
        from playwright.sync_api import Error

        for page in (page for context in started.contexts for page in context.pages):
            with suppress(Error):  # of one that was killed
                yield page.locator('body').inner_text(timeout=TEXT_TIMEOUT)


def picture(page: Page, name: str) -> None:
    """Keep a picture of the whole page, where SCREENSHOTS is set: one takes seconds."""
    if os.environ.get('SCREENSHOTS'):
        PICTURES.mkdir(parents=True, exist_ok=True)
        with drawn(page):
            page.screenshot(path=PICTURES / f'{name}.png', timeout=3 * PAGE_TIMEOUT)


@contextmanager
def drawn(page: Page) -> Iterator[None]:
    """Draw the scene meanwhile."""
    before = page.evaluate('window.drawn')
    page.evaluate('window.drawn = true')
    page.evaluate(TWO_PICTURES)
    try:
        yield
    finally:
        page.evaluate(f'window.drawn = {str(before).lower()}')


def wait_for_colors(page: Page, count: int) -> None:
    """Wait until so many pixels of the scene have a colour: floor and sky are grey."""
    deadline = time.monotonic() + PAGE_TIMEOUT / 1000.0
    with drawn(page):
        while (found := _colors_of_scene(page)) < count:
            assert time.monotonic() < deadline, f'{found} pixels have a colour'


def _colors_of_scene(page: Page) -> int:
    from PIL import Image

    png = page.screenshot(timeout=3 * PAGE_TIMEOUT)
    image = Image.open(io.BytesIO(png)).convert('HSV')
    width, height = image.size
    scene = image.crop((0, TOP, width - PANEL, height - BELOW))  # without STOP and the panel
    return sum(scene.getchannel('S').histogram()[64:])


def state_is(page: Page, word: str) -> None:
    """Wait until the state of the robot on a page is a word, or begins with it."""
    page.locator('#rv-state b').filter(has_text=re.compile(f'^{word}')).wait_for()


def see_fault(page: Page, reason: str, action: str) -> None:
    """Check that a fault is seen in each group at each size, and that nothing can be moved."""
    state, button = page.locator('#rv-state'), page.locator('#rv-do')
    groups = page.locator('[role=tab]').all_inner_texts()[:GROUPS]
    assert len(groups) == GROUPS, groups
    tab = page.get_by_role('tab', name=groups[0], exact=True)
    for size, (width, height) in SIZES.items():
        page.set_viewport_size({'width': width, 'height': height})
        _wait_until_it_stands(tab, IN_SIGHT)  # viser has laid its panel out anew
        for group in groups:
            show(page, group)
            where = size, group
            assert re.match(f'FAULT.*{reason}', state.inner_text(), re.DOTALL), where
            assert (button.inner_text(), button.evaluate(REACHED)) == (action, True), where
            assert not page.evaluate(ACTIVE), where
    page.set_viewport_size(SIZE)  # type: ignore[arg-type]
    _wait_until_it_stands(tab, IN_SIGHT)


def act(page: Page, action: str) -> None:
    """Press the action of the state."""
    page.locator('#rv-do').filter(has_text=action).click(force=True)


def show(page: Page, *tabs: str) -> None:
    """Show a group of the page, and tabs in it."""
    for tab in tabs:
        # forced: a busy machine draws too seldom for playwright to find out that something stands
        page.get_by_role('tab', name=tab, exact=True).click(force=True)


def press(found: Locator) -> None:
    """Press a button once it stands in sight."""
    _wait_until_it_stands(found, IN_SIGHT)
    found.click(force=True)


def _wait_until_it_stands(found: Locator, condition: str = '() => true') -> None:
    """Wait while what is folded out, or comes above it, moves it, and for a condition of it."""
    found.wait_for()
    deadline, before = time.monotonic() + PAGE_TIMEOUT / 1000.0, None
    while True:
        holds, place = found.evaluate(condition), found.bounding_box()
        if holds and place is not None and place == before:
            return
        assert time.monotonic() < deadline, f'{found} never stands'
        before = place
        found.page.wait_for_timeout(STANDS)


def hold(page: Page, button: str) -> None:
    """Press a button of the panel with the mouse, and keep it pressed."""
    found = page.get_by_role('button', name=button, exact=True)
    while True:
        _wait_until_it_stands(found)
        pressed = found.element_handle()
        # forced: a busy machine draws too seldom for playwright to find out that something stands
        found.hover(force=True)
        page.mouse.down()
        if pressed.evaluate('element => element.isConnected'):
            return
        page.mouse.up()  # it was made anew in between


def drag(page: Page, slider: int, share: float) -> None:
    """Drag a slider of the open tab to a share of its way."""
    thumb = page.locator('[role=slider]:visible').nth(slider)
    _wait_until_it_stands(thumb)
    box, track = thumb.bounding_box(), thumb.locator('xpath=..').bounding_box()
    assert box is not None
    assert track is not None
    page.mouse.move(box['x'] + box['width'] / 2, box['y'] + box['height'] / 2)
    page.mouse.down()
    page.mouse.move(track['x'] + share * track['width'], box['y'] + box['height'] / 2, steps=4)
    page.mouse.up()
    low, high = (float(thumb.get_attribute(f'aria-value{end}') or 'nan') for end in ('min', 'max'))
    deadline = time.monotonic() + PAGE_TIMEOUT / 1000.0
    while not abs(slider_value(page, slider) - low - share * (high - low)) < NEAR * (high - low):
        assert time.monotonic() < deadline, 'the slider does not follow the mouse'
        page.wait_for_timeout(STANDS)


def slider_value(page: Page, slider: int) -> float:
    """Return what a slider of the open tab shows."""
    thumb = page.locator('[role=slider]:visible').nth(slider)
    return float(thumb.get_attribute('aria-valuenow') or 'nan')


def choose(page: Page, dropdown: str, option: str) -> None:
    """Choose an option of a dropdown of the open tab."""
    press(page.get_by_label(dropdown, exact=True))
    press(page.get_by_role('option', name=option, exact=True))


def drag_arrow(page: Page, color: str, way: int) -> None:
    """Drag what is red or green in the scene to the left by pixels, once it is drawn.

    Args:
        page: The page.
        color: red or green; the leftmost place of that color is taken.
        way: How far.
    """
    channel = ('red', 'green').index(color)
    deadline = time.monotonic() + PAGE_TIMEOUT / 1000.0
    with drawn(page):
        before, place = None, _leftmost(page, channel)
        while place is None or place != before:  # a canvas says nothing of what it draws
            if time.monotonic() > deadline:
                raise AssertionError(f'nothing {color} stands still in the scene')
            before, place = place, _leftmost(page, channel)
    x, y = place[0] + 4, place[1]
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x - way, y, steps=4)
    page.mouse.up()


def _leftmost(page: Page, channel: int) -> tuple[int, int] | None:
    """Return the leftmost pixel of the scene in which one of red, green and blue stands out."""
    from PIL import Image

    image = Image.open(io.BytesIO(page.screenshot())).convert('RGB')
    scene = np.asarray(image, dtype=int)[TOP:-BELOW, : image.width - PANEL]
    others = np.delete(scene, channel, axis=2).max(axis=2)
    rows, columns = np.nonzero(scene[:, :, channel] > others + 60)
    if not len(columns):
        return None
    first = int(columns.argmin())
    return int(columns[first]), int(rows[first]) + TOP
