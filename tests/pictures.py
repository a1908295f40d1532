#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Takes the pictures of the README: the pages of both demos in a real browser.

Run: ``make pictures``; writes ``arm.png``, ``quadruped.png`` and ``phone.png`` in ``docs``. Needs
Chromium.
"""

from __future__ import annotations

from pathlib import Path
import re
from typing import TYPE_CHECKING

import browser as chromium
from isolation import reserve
from processes import executable, RunningProcess

if TYPE_CHECKING:
    from playwright.sync_api import Browser

DOCS = Path(__file__).parents[1] / 'docs'
DESK, PHONE = {'width': 1200, 'height': 680}, {'width': 390, 'height': 844}  # [px]
STARTING = 90.0  # [s]
MOVING = 10.0  # [s] until the picture


def take(demo: tuple[str, ...], views: dict[str, tuple[str, dict[str, int]]]) -> None:
    """Take pictures of a demo, while its robot moves.

    Args:
        demo: Package, program and arguments.
        views: Group of the page and size, by the name of the picture.
    """
    package, program, *arguments = demo
    with (
        reserve() as isolation,
        RunningProcess(
            [executable(package, program), *arguments], isolation.env | {'NO_VIEW': ''}
        ) as running,
        chromium.browser() as browser,
    ):
        line = running.wait_for(r'seen at http://localhost:\d+', STARTING)
        found = re.search(r'http://localhost:\d+', line)
        assert found is not None
        for name, (group, size) in views.items():
            take_one(browser, found[0], group, size, DOCS / f'{name}.png')
        running.stop()


def take_one(browser: Browser, url: str, group: str, size: dict[str, int], path: Path) -> None:
    """Take one picture."""
    phone = size is PHONE
    page = chromium.open_page(
        browser, url, drawn=True, viewport=size, has_touch=phone, is_mobile=phone
    )
    chromium.show(page, group)
    page.wait_for_timeout(1e3 * MOVING)
    chromium.state_is(page, '(MOVING|WALKING)')
    page.screenshot(path=path, timeout=3 * chromium.PAGE_TIMEOUT)
    page.close()


def main() -> None:
    """Entry point."""
    arm = {'arm': ('Drive', DESK), 'phone': ('Drive', PHONE)}
    take(('arm_bringup', 'motion_demo', 'panda'), arm)
    take(('quad_bringup', 'demo'), {'quadruped': ('Drive', DESK)})


if __name__ == '__main__':
    main()
