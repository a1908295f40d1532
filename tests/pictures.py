#!/usr/bin/env python3
# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Takes the pictures of the README: the pages of both demos in a real browser.

Run: ``python tests/pictures.py`` in the sourced workspace; writes ``docs/arm.png`` and
``docs/quadruped.png``. Needs Chromium.
"""

from __future__ import annotations

from pathlib import Path
import re

import browser as chromium
from isolation import reserve
from processes import executable, RunningProcess

DOCS = Path(__file__).parents[1] / 'docs'
SIZE = {'width': 1200, 'height': 640}  # [px]
STARTING = 90.0  # [s]
MOVING = 25.0  # [s] the plots reach back that far then


def take(demo: tuple[str, ...], tab: str, path: Path) -> None:
    """Take the picture of a demo, while its robot moves.

    Args:
        demo: Package, program and arguments.
        tab: Of the page.
        path: File to write.
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
        page = chromium.open_page(browser, found[0], viewport=SIZE)
        page.get_by_role('tab', name=tab).click(timeout=1e3 * STARTING)
        page.locator('.mantine-Notification-closeButton').first.click()  # of the software renderer
        page.wait_for_timeout(1e3 * MOVING)
        page.screenshot(path=path)
        running.stop()


def main() -> None:
    """Entry point."""
    take(('arm_bringup', 'motion_demo', 'panda'), 'Plots', DOCS / 'arm.png')
    take(('quad_bringup', 'demo'), 'Walk', DOCS / 'quadruped.png')


if __name__ == '__main__':
    main()
