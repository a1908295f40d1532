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
"""Silence in [s] after which a button counts as let go."""

_Press: TypeAlias = tuple[Hashable, Hashable]  # a page and its button


class Deadman:
    """Distinguishes a heartbeat that counts from one that does not.

    A caller that moves something sends one command for each heartbeat that counts, and nothing
    else: a page that is gone sends none, and the robot's own time-out stops the motion. Of what a
    slow connection has held up and delivers at once, one counts. After a stop a button that was
    held has to be let go, however its heartbeats pause; so has one that was refused, as it would
    move the robot when that ends, under a finger that waits.

    One page has control: the first that holds a button, until it is closed or another takes it.

    Attributes:
        holder: The page that has control; None for none.
    """

    def __init__(self) -> None:
        """Begin with no button held."""
        self.holder: Hashable = None
        self._last = -math.inf
        self._pressed: set[_Press] = set()  # what was not let go
        self._barred: set[_Press] = set()  # what has to be, after a stop
        self._released: dict[_Press, float] = {}

    def stop(self) -> None:
        """Ignore heartbeats of a button that is held now, until it is released."""
        self._barred |= self._pressed

    def end(self, button: Hashable) -> None:
        """Ignore a button that is held until it is released: what it did has ended."""
        ended = {press for press in self._pressed if press[1] == button}
        self._barred |= ended
        if ended:
            self._last = -math.inf

    def bar(self, page: Hashable, button: Hashable) -> None:
        """Ignore a press that may not move anything now, until it is released."""
        self._pressed.add((page, button))
        self._barred.add((page, button))

    def held(self, now: float) -> bool:
        """Whether a button is held."""
        return now - self._last < RELEASED_AFTER

    def take(self, page: Hashable, now: float) -> bool:
        """Give control to a page, unless a button is held; return whether it has it."""
        if not self.held(now):
            self.holder = page
        return self.holder == page

    def leave(self, page: Hashable) -> None:
        """Forget a page that was closed."""
        for presses in (self._pressed, self._barred):
            presses.difference_update([press for press in presses if press[0] == page])
        self._released = {press: at for press, at in self._released.items() if press[0] != page}
        if self.holder == page:
            self.holder = None

    def release(self, page: Hashable, button: Hashable, now: float) -> bool:
        """Record that a page has released; return whether it was the one that held."""
        press = page, button
        self._pressed.discard(press)
        self._barred.discard(press)
        self._released[press] = now
        if page == self.holder:
            self._last = -math.inf
        return page == self.holder

    def beat(self, page: Hashable, button: Hashable, now: float) -> bool:
        """Process a heartbeat; return whether it counts."""
        press = page, button
        if now - self._released.get(press, -math.inf) < LEAST_GAP:
            return False  # of the button that was let go; a slow connection brings it later
        self._pressed.add(press)
        if press in self._barred:
            return False
        if self.holder is None:
            self.holder = page
        if page != self.holder:
            self._barred.add(press)
            return False
        gap, self._last = now - self._last, now
        return gap >= LEAST_GAP
