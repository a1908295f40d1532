# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A held button of a page counts as long as its heartbeats come steadily, from one page."""

from __future__ import annotations

from collections.abc import Hashable
import math

HEARTBEAT = 1.0 / 30.0
"""Time between two heartbeats of a held button in [s]."""
LEAST_GAP = 0.4 * HEARTBEAT
"""Heartbeats that are nearer to each other in [s] were held up: they may be of a button let go."""
RELEASED_AFTER = 0.3
"""Silence in [s] after which another page may hold a button."""


class Deadman:
    """Distinguishes a heartbeat that counts from one that does not.

    Whoever moves something by it sends one command for each heartbeat that counts, and nothing
    else: a page that is gone sends none, and the robot's own time-out stops the motion. Of what a
    slow connection has held up and delivers at once, one counts. After a stop a button that was
    held has to be let go, however its heartbeats pause.
    """

    def __init__(self) -> None:
        """Begin with no button held."""
        self._holder: Hashable = None
        self._last = -math.inf
        self._pressed: set[Hashable] = set()  # pages that have not let go
        self._barred: set[Hashable] = set()  # those that have to, after a stop
        self._released: dict[Hashable, float] = {}

    def stop(self) -> None:
        """Let no heartbeat of a button count that is held now, until it is let go."""
        self._barred |= self._pressed

    def release(self, page: Hashable, now: float) -> bool:
        """Take note that a page has let go; return whether it was the one that holds.

        Args:
            page: Which page.
            now: Steady time in [s].
        """
        self._pressed.discard(page)
        self._barred.discard(page)
        self._released[page] = now
        return page == self._holder

    def beat(self, page: Hashable, now: float) -> bool:
        """Take a heartbeat; return whether it counts.

        Args:
            page: Which page it is of.
            now: Steady time of its arrival in [s].
        """
        if now - self._released.get(page, -math.inf) < LEAST_GAP:
            return False  # of the button that was let go; threads may have changed their order
        self._pressed.add(page)
        if page in self._barred:
            return False
        gap = now - self._last
        if page != self._holder and gap < RELEASED_AFTER:
            return False
        self._holder, self._last = page, now
        return gap >= LEAST_GAP
