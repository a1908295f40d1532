# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The overlay's own connection with each page: heartbeats of held buttons in, the state out.

viser has one sender for all inputs of a page, which drops the older of two that come within 50 ms.
Held buttons and the state of the robot have a WebSocket of their own, on the same port.
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
"""No page has this number."""
HEARTBEAT = 1.0 / 30.0  # time between two heartbeats of a held button in [s]
LEAST_GAP = 0.4 * HEARTBEAT
"""Heartbeats that are nearer to each other in [s] were held up: they may be of a button let go."""
RELEASED_AFTER = 0.3  # silence in [s] after which a button counts as let go

_Press: TypeAlias = tuple[Hashable, Hashable]  # a page and its button


@dataclass(frozen=True, slots=True)
class Hold:
    """A button that acts as long as it is held."""

    label: str  # what it is called, and what is held
    act: Callable[[], None]  # called with each heartbeat
    rest: Callable[[], None]  # called when it is let go
    start: Callable[[], None] | None = None  # called with the first heartbeat of a press
    always: bool = False  # it counts whatever state the robot is in, but not after STOP
    key: str = ''
    """The key that holds it, where keys move the robot; that of a joint with its direction."""


class Live:
    """The pages that are open, and the buttons that are held on them.

    Attributes:
        movable: The state of the robot lets it be moved.
        off: Why a button would do nothing now, by its number.
        stopped: STOP was pressed, and nothing was allowed since.
        held: Label of the button that is held; empty for none.
    """

    def __init__(self, command: Callable[[str, str], None]) -> None:
        """Set what a command of a page does: its word and what stands behind it."""
        self._command = command
        self._deadman = Deadman()
        self._numbers = itertools.count(1)
        self._holds: dict[int, Hold] = {}
        self._pages: dict[int, tuple[ServerConnection, str]] = {}
        self._started: set[tuple[int, int]] = set()  # presses that have begun
        self._label = ''
        self._loop: asyncio.AbstractEventLoop | None = None
        self._last = ''
        self.movable = self.stopped = False
        self.off: dict[int, str] = {}

    # -- buttons

    def button(self, hold: Hold) -> tuple[int, str]:
        """Return the number of a new button and its HTML."""
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
        """End the press of a button: what it did has ended, and it moves nothing more."""
        self._deadman.end(number)

    def refuses(self, what: str, *, always: bool = True) -> bool:
        """Whether something that one press requests may not be done now; if so the page says why.

        ``always``: it counts whatever state the robot is in, but not after STOP.
        """
        if self.stopped:
            self._command('say', f'{what}: stopped; press {ALLOW} first')
        elif not always and not self.movable:
            self._command('say', f'{what}: the state of the robot does not let it be moved')
        else:
            return False
        return True

    def stop(self) -> None:
        """Release what is held, and bar motion until it is allowed."""
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
        """Show a state on all pages, from any thread."""
        kind = self._pages.get(self.holder, (None, ''))[1]
        more = {'holder': self.holder, 'kind': kind, 'off': self.off}
        self._last = json.dumps({**state, **more})
        if self._loop is not None:
            with suppress(RuntimeError):  # it has ended
                self._loop.call_soon_threadsafe(self._send, self._last)

    def _send(self, text: str) -> None:
        broadcast([connection for connection, _ in list(self._pages.values())], text)


class Deadman:
    """Distinguishes a heartbeat that counts from one that does not.

    A caller that moves something sends one command for each heartbeat that counts, and nothing
    else: a page that is gone sends none, and the robot's own time-out stops the motion. Of what a
    slow connection has held up and delivers at once, one counts. After a stop a button that was
    held has to be let go, however its heartbeats pause. A refused press has to be released, too;
    otherwise the robot would start when the reason for the refusal ends.

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
        pressed = tuple(self._pressed)  # another thread may add to it
        ended = {press for press in pressed if press[1] == button}
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
            presses.difference_update([press for press in tuple(presses) if press[0] == page])
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
