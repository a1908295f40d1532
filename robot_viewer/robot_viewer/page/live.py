# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The overlay's WebSocket to each page: receives heartbeats of held buttons, sends the state.

viser has one sender for all inputs of a page, which drops the older of two within 50 ms. Held
buttons and robot state therefore use a separate WebSocket on the same port.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Hashable
from contextlib import suppress
from dataclasses import dataclass
from html import escape
import itertools
import json
import math
import time
from typing import TypeAlias

from websockets.asyncio.server import broadcast, ServerConnection
from websockets.exceptions import ConnectionClosed

from ..robot_state import ALLOW

LIVE_PATH = '/live'
NO_PAGE = 0
"""Number that no page has."""
HEARTBEAT = 1.0 / 30.0  # time between two heartbeats of a held button in [s]
LEAST_GAP = 0.4 * HEARTBEAT
"""Minimum gap of heartbeats in [s]: closer ones were delayed, and may be of a released button."""
RELEASED_AFTER = 0.3  # time in [s] without heartbeat after which a button counts as released

_Press: TypeAlias = tuple[Hashable, Hashable]  # a page and its button


@dataclass(frozen=True, slots=True)
class Hold:
    """A button that acts while it is held."""

    label: str  # its text, also shown while it is held
    act: Callable[[], None]  # called with each heartbeat
    rest: Callable[[], None]  # called on release
    start: Callable[[], None] | None = None  # called with the first heartbeat of a press
    always: bool = False  # acts in any state of the robot, but not after STOP
    key: str = ''
    """Key that holds the button if keys move the robot; for a joint with its direction."""


class Live:
    """Open pages, and the buttons held on them.

    Attributes:
        movable: Whether the state of the robot permits motion.
        off: Reasons why buttons are inactive now, by button number.
        stopped: Whether STOP was pressed, and motion not allowed again since.
        held: Label of the button that is held; empty for none.
    """

    def __init__(self, command: Callable[[str, str], None]) -> None:
        """Set the handler for commands of a page: a word and its argument."""
        self._command = command
        self._deadman = Deadman()
        self._numbers = itertools.count(1)
        self._holds: dict[int, Hold] = {}
        self._pages: dict[int, tuple[ServerConnection, str]] = {}
        self._started: set[tuple[int, int]] = set()  # presses whose start was processed
        self._label = ''
        self._loop: asyncio.AbstractEventLoop | None = None
        self._last = ''
        self.movable = self.stopped = False
        self.off: dict[int, str] = {}

    # -- buttons

    def button(self, hold: Hold) -> tuple[int, str]:
        """Create a button; return its number and HTML."""
        number = next(self._numbers)
        self._holds[number] = hold
        kind = 'rv-hold rv-always' if hold.always else 'rv-hold'
        html = (
            f'<button class="{kind}" data-hold="{number}" data-key="{escape(hold.key)}"'
            f' tabindex="-1"><span>{escape(hold.label)}</span></button>'
        )
        return number, html

    def remove(self, number: int) -> None:
        """Disconnect a button."""
        self._holds.pop(number, None)
        self.off.pop(number, None)

    def clear(self) -> None:
        """Disconnect all buttons."""
        self._holds.clear()
        self.off.clear()

    @property
    def open(self) -> bool:
        """Whether a page is open."""
        return bool(self._pages)

    @property
    def held(self) -> str:
        """Label of the button that is held; empty for none."""
        return self._label if self._deadman.held(time.monotonic()) else ''

    @property
    def holder(self) -> int:
        """The page that has control."""
        return int(self._deadman.holder or NO_PAGE)  # type: ignore[call-overload, no-any-return]

    def end(self, number: int) -> None:
        """Ignore the rest of a button's press, because its motion has ended."""
        self._deadman.end(number)

    def refuses(self, what: str, *, always: bool = True) -> bool:
        """Return whether a single-press request is refused now; if so, report why on the page.

        ``always`` permits it in any state of the robot, but not after STOP.
        """
        if self.stopped:
            self._command('say', f'{what}: stopped; press {ALLOW} first')
        elif not always and not self.movable:
            self._command('say', f'{what}: the state of the robot does not let it be moved')
        else:
            return False
        return True

    def stop(self) -> None:
        """Release held buttons, and block motion until it is allowed again."""
        self.stopped = True
        self._deadman.stop()

    def _beat(self, page: int, number: int) -> None:
        hold = self._holds.get(number)
        if hold is None:
            return
        if self.stopped or not (self.movable or hold.always):
            self._deadman.bar(page, number)
            return
        if not self._deadman.beat(page, number, time.monotonic()):
            return
        self._label = hold.label
        if (page, number) not in self._started:
            self._started.add((page, number))
            if hold.start is not None:
                hold.start()
        hold.act()

    def _release(self, page: int, number: int) -> None:
        self._started.discard((page, number))
        hold = self._holds.get(number)
        if self._deadman.release(page, number, time.monotonic()) and hold is not None:
            hold.rest()

    # -- pages

    async def serve(self, connection: ServerConnection) -> None:
        """Serve a page until it is closed."""
        self._loop = asyncio.get_running_loop()
        page = next(self._numbers)
        kind = 'computer'
        self._pages[page] = connection, kind
        try:
            await connection.send(json.dumps({'you': page}))
            if self._last:
                await connection.send(self._last)
            async for text in connection:
                word, _, rest = str(text).partition(' ')
                if word in {'beat', 'free'} and rest.isdecimal():
                    (self._beat if word == 'beat' else self._release)(page, int(rest))
                elif word == 'ping':
                    await connection.send(f'{{"pong": {rest}}}')
                elif word == 'hello':
                    self._pages[page] = connection, 'phone' if rest == 'phone' else kind
                elif word == 'take':
                    if not self._deadman.take(page, time.monotonic()):
                        self._command('say', 'Another page holds a button: let go there first')
                else:
                    self._command(word, rest)
        except ConnectionClosed:
            pass
        finally:
            self._pages.pop(page, None)
            self._started = {press for press in self._started if press[0] != page}
            self._deadman.leave(page)

    def show(self, state: dict[str, object]) -> None:
        """Send a state to all pages. Thread-safe."""
        kind = self._pages.get(self.holder, (None, ''))[1]
        more = {'holder': self.holder, 'kind': kind, 'off': self.off}
        self._last = json.dumps({**state, **more})
        if self._loop is not None:
            with suppress(RuntimeError):  # the event loop has ended
                self._loop.call_soon_threadsafe(self._send, self._last)

    def _send(self, text: str) -> None:
        broadcast([connection for connection, _ in list(self._pages.values())], text)


class Deadman:
    """Decides which heartbeats are valid.

    The caller sends one motion command per valid heartbeat, and no others: if a page is gone, the
    robot's own time-out stops the motion. If several heartbeats arrive together, only one counts.
    After a stop, a held button must be released, however its heartbeats pause. A refused press
    must be released, too; otherwise the robot would start when the reason for the refusal ends.

    One page has control: the first that holds a button, until it closes or another takes over.

    Attributes:
        holder: The page that has control; None for none.
    """

    def __init__(self) -> None:
        self.holder: Hashable = None
        self._last = -math.inf
        self._pressed: set[_Press] = set()  # not released yet
        self._barred: set[_Press] = set()  # ignored until released
        self._released: dict[_Press, float] = {}

    def stop(self) -> None:
        """Ignore all buttons held now until they are released."""
        self._barred |= self._pressed

    def end(self, button: Hashable) -> None:
        """Ignore a held button until it is released, because its motion has ended."""
        pressed = tuple(self._pressed)  # another thread may add to it
        ended = {press for press in pressed if press[1] == button}
        self._barred |= ended
        if ended:
            self._last = -math.inf

    def bar(self, page: Hashable, button: Hashable) -> None:
        """Ignore a refused press until it is released."""
        self._pressed.add((page, button))
        self._barred.add((page, button))

    def held(self, now: float) -> bool:
        """Whether a button is held."""
        return now - self._last < RELEASED_AFTER

    def take(self, page: Hashable, now: float) -> bool:
        """Give control to a page, unless a button is held; return whether the page has control."""
        if not self.held(now):
            self.holder = page
        return self.holder == page

    def leave(self, page: Hashable) -> None:
        """Remove a closed page."""
        for presses in (self._pressed, self._barred):
            presses.difference_update([press for press in tuple(presses) if press[0] == page])
        self._released = {press: at for press, at in self._released.items() if press[0] != page}
        if self.holder == page:
            self.holder = None

    def release(self, page: Hashable, button: Hashable, now: float) -> bool:
        """Record the release of a button; return whether its page has control."""
        press = page, button
        self._pressed.discard(press)
        self._barred.discard(press)
        self._released[press] = now
        if page == self.holder:
            self._last = -math.inf
        return page == self.holder

    def beat(self, page: Hashable, button: Hashable, now: float) -> bool:
        """Process a heartbeat; return whether it is valid."""
        press = page, button
        if now - self._released.get(press, -math.inf) < LEAST_GAP:
            return False  # late heartbeat of a released button
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
