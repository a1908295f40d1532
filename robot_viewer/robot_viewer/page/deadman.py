# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A held button of a page counts as long as its heartbeats come steadily, from one page."""

from __future__ import annotations

from collections.abc import Hashable
import math
from typing import TypeAlias

HEARTBEAT = 1.0 / 30.0
"""Time between two heartbeats of a held button in [s]."""
LEAST_GAP = 0.4 * HEARTBEAT
"""Heartbeats that are nearer to each other in [s] were held up: they may be of a button let go."""
RELEASED_AFTER = 0.3
"""Silence in [s] after which another page may hold a button."""

_Press: TypeAlias = tuple[Hashable, Hashable]  # a page and its button


class Deadman:
    """Distinguishes a heartbeat that counts from one that does not.

    Whoever moves something by it sends one command for each heartbeat that counts, and nothing
    else: a page that is gone sends none, and the robot's own time-out stops the motion. Of what a
    slow connection has held up and delivers at once, one counts. After a stop a button that was
    held has to be let go, however its heartbeats pause; one that was taken off the page is over.
    """

    def __init__(self) -> None:
        """Begin with no button held."""
        self._holder: Hashable = None
        self._last = -math.inf
        self._pressed: set[_Press] = set()  # what was not let go
        self._barred: set[_Press] = set()  # what has to be, after a stop
        self._released: dict[_Press, float] = {}

    def stop(self) -> None:
        """Ignore heartbeats of a button that is held now, until it is released."""
        self._barred |= self._pressed

    def release(self, page: Hashable, button: Hashable, now: float) -> bool:
        """Record that a page has released; return whether it was the one that held."""
        press = page, button
        self._pressed.discard(press)
        self._barred.discard(press)
        self._released[press] = now
        return page == self._holder

    def beat(self, page: Hashable, button: Hashable, now: float) -> bool:
        """Process a heartbeat; return whether it counts."""
        press = page, button
        if now - self._released.get(press, -math.inf) < LEAST_GAP:
            return False  # of the button that was let go; threads may have changed their order
        self._pressed.add(press)
        if press in self._barred:
            return False
        gap = now - self._last
        if page != self._holder and gap < RELEASED_AFTER:
            return False
        self._holder, self._last = page, now
        return gap >= LEAST_GAP
