# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keyboard of the operator: keys from a terminal, releases from the best available source.

A keyboard device knows neither focus nor layout, so presses are never read from it: they come from
the terminal, which has the focus. A character belongs to the key that went down just before it (or
just after, when the two reports overtake each other); that key going up is its release. This works
for every layout, and text typed in other windows is never taken for a command.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
import contextlib
from enum import Enum
import os
import select
import subprocess
import time
from typing import TYPE_CHECKING

from .devices import (
    DeviceSearch,
    EV_KEY,
    EV_SYN,
    InputDevice,
    InputDevices,
    SYN_DROPPED,
)
from .exceptions import DeviceError
from .keys import KeyAction, KeyEvent
from .terminal import CONTROLLING_TERMINAL, Stage, StatusLine, TerminalKeyboard

if TYPE_CHECKING:
    from typing_extensions import Self


WINDOW = 0.25  # [s] by which a terminal may report a character later than the keyboard
OVERTAKEN = 0.05  # [s] by which it may report it earlier, as we read it
# Control, Shift, Alt, Meta and the locks type nothing (KEY_LEFTCTRL ... KEY_RIGHTMETA)
MODIFIERS = frozenset({29, 42, 54, 56, 58, 69, 70, 97, 100, 125, 126})
KEY_Q, KEY_SPACE = 16, 57  # what has these is a keyboard, not a power button
SCAN_PERIOD = 2.0  # [s] between two looks for keyboards that were plugged in
OTHERS_PERIOD = 20.0  # [s] for which a device that is no keyboard is not opened again

_SSH = ('SSH_CONNECTION', 'SSH_TTY', 'SSH_CLIENT')


class ReleaseMatcher:
    """Merges the events of a terminal and of keyboards; pure, times are in [s]."""

    def __init__(self) -> None:
        self._down: dict[int, float] = {}  # when each key went down, as long as it is down
        self._tapped: tuple[int, float] | None = None  # the last one that went up unmatched
        self._matched: dict[int, str] = {}  # the name of each key that is down
        self._last_typed: KeyEvent | None = None  # not matched yet

    def key_down(self, code: int, now: float) -> list[KeyEvent]:
        """Record a key that went down.

        Returns:
            A press, if its character was already received; its release, if it was down.
        """
        if code in MODIFIERS:
            return []
        # a second keyboard may have the same key down; then the origin of the character is unknown
        events = self.key_up(code, now) if code in self._matched else []
        self._down[code] = now
        typed, self._last_typed = self._last_typed, None
        if typed is None or now - typed.time > OVERTAKEN:
            return events
        return events + self._match(code, typed.key, now)

    def key_up(self, code: int, now: float) -> list[KeyEvent]:
        """Record a key that went up; return the release of its character, if known."""
        went_down = self._down.pop(code, None)
        name = self._matched.pop(code, None)
        if name is not None:
            return [KeyEvent(name, KeyAction.RELEASED, now)]
        if went_down is not None:
            self._tapped = (code, went_down)
        return []

    def terminal(self, event: KeyEvent) -> list[KeyEvent]:
        """Process an event of the terminal; one that is TYPED may become PRESSED or REPEATED."""
        if event.action is KeyAction.ALL_RELEASED:
            self._matched.clear()
        if event.action is not KeyAction.TYPED:
            return [event]
        if event.key in self._matched.values():
            return [KeyEvent(event.key, KeyAction.REPEATED, event.time)]
        code = self._candidate(event.time)
        if code is not None:
            return self._match(code, event.key, event.time)
        tapped, self._tapped = self._tapped, None
        if tapped is not None and event.time - tapped[1] <= WINDOW:
            return [
                KeyEvent(event.key, action, event.time)
                for action in (KeyAction.PRESSED, KeyAction.RELEASED)
            ]
        self._last_typed = event
        return [event]

    def lose_all(self, now: float) -> list[KeyEvent]:
        """Release all keys, as a lost keyboard will not report them."""
        lost = list(self._matched.values())
        self._matched.clear()
        self._down.clear()
        return [KeyEvent(key, KeyAction.RELEASED, now) for key in lost]

    def _candidate(self, now: float) -> int | None:
        recent = [
            code
            for code, since in self._down.items()
            if code not in self._matched and now - since <= WINDOW
        ]
        return max(recent, key=self._down.__getitem__, default=None)

    def _match(self, code: int, key: str, now: float) -> list[KeyEvent]:
        self._matched[code] = key
        return [KeyEvent(key, KeyAction.PRESSED, now)]


class Keyboards:
    """All readable keyboards of this machine; feeds a matcher with their keys."""

    def __init__(self, devices: InputDevices, matcher: ReleaseMatcher) -> None:
        self._search = DeviceSearch(
            devices, lambda info: {KEY_Q, KEY_SPACE} <= info.keys, SCAN_PERIOD, OTHERS_PERIOD
        )
        self._matcher = matcher
        self._open: dict[str, InputDevice] = {}

    @property
    def names(self) -> list[str]:
        """The names of the keyboards."""
        return [device.info.name for device in self._open.values()]

    def filenos(self) -> list[int]:
        """Return the file descriptors to wait for."""
        return [device.fileno() for device in self._open.values()]

    def scan(self, now: float) -> None:
        """Search for new keyboards if a scan is due."""
        for device in self._search.found(now, self._open.__contains__):
            self._open[device.info.path] = device

    def read(self, now: float) -> list[KeyEvent]:
        """Read pending events, without waiting."""
        events: list[KeyEvent] = []
        for path, device in list(self._open.items()):
            with contextlib.suppress(DeviceError):
                events += self._read(device, now)
                continue
            device.close()
            del self._open[path]
            events += self._matcher.lose_all(now)
        return events

    def close(self) -> None:
        """Close every keyboard."""
        for device in self._open.values():
            device.close()
        self._open.clear()

    def _read(self, device: InputDevice, now: float) -> list[KeyEvent]:
        events: list[KeyEvent] = []
        for event in device.read():
            if event.type == EV_SYN and event.code == SYN_DROPPED:
                events += self._matcher.lose_all(now)  # an up may be among what was dropped
            elif event.type == EV_KEY and event.value == 1:
                events += self._matcher.key_down(event.code, now)
            elif event.type == EV_KEY and event.value == 0:
                events += self._matcher.key_up(event.code, now)
        return events


def is_local(environment: Mapping[str, str], read_tmux: Callable[[], str] | None = None) -> bool:
    """Return whether the person at the terminal sits at a keyboard of this machine.

    Inside tmux, the person may have connected by SSH after the shell started; tmux records it.

    Args:
        environment: Variables of this process.
        read_tmux: Returns tmux's record of SSH_CONNECTION; replaced in tests.
    """
    if environment.get('STY'):  # screen does not report who is attached
        return False
    if environment.get('TMUX'):
        return (read_tmux or _read_tmux)().startswith('-SSH_CONNECTION')
    return not any(environment.get(name) for name in _SSH)


def _read_tmux() -> str:
    try:
        return subprocess.run(
            ['tmux', 'show-environment', 'SSH_CONNECTION'],
            capture_output=True,
            text=True,
            timeout=1.0,
            check=False,
        ).stdout
    except (OSError, subprocess.TimeoutExpired):
        return ''


class ReleaseSource(Enum):
    """Source of key releases."""

    TERMINAL = 'terminal'
    """The Kitty keyboard protocol."""

    KEYBOARD = 'keyboard'
    """The keyboard itself, by evdev."""

    TIME_OUT = 'time-out'
    """No source; a key is up when its next repeat is overdue."""


class Keyboard:
    """Key events of the operator, with true releases if the machine provides them."""

    def __init__(
        self,
        path: str = CONTROLLING_TERMINAL,
        *,
        devices: InputDevices | None = None,
        environment: Mapping[str, str] = os.environ,
        kitty: bool = True,
        evdev: bool = True,
    ) -> None:
        """Prepare; entering the context opens the terminal.

        Args:
            path: Device of the terminal.
            devices: Input devices; None for those of this machine.
            environment: Shows whether the terminal is on this machine.
            kitty: Use the releases that the terminal reports.
            evdev: Use releases from this machine's keyboards, if the terminal reports none.
        """
        self._terminal = TerminalKeyboard(path, kitty=kitty)
        self._matcher = ReleaseMatcher()
        self._keyboards = Keyboards(devices or InputDevices(), self._matcher)
        self._watch_keyboards = evdev and is_local(environment)

    @property
    def release_source(self) -> ReleaseSource:
        """Current source of key releases."""
        if self._terminal.stage is Stage.ACTIVE:
            return ReleaseSource.TERMINAL
        return ReleaseSource.KEYBOARD if self._keyboards.names else ReleaseSource.TIME_OUT

    def status_line(self) -> StatusLine:
        """Return a status line on the same terminal."""
        return StatusLine(self._terminal)

    def wait(self, timeout: float, others: Iterable[int] = ()) -> list[KeyEvent]:
        """Wait at most ``timeout`` in [s] for a key, or for one of the other file descriptors.

        Returns:
            The events in order; empty after the time-out.

        Raises:
            TerminalError: The terminal was closed. All keys count as released.
        """
        if self._watch_keyboards and self._terminal.stage is not Stage.ACTIVE:
            self._keyboards.scan(time.monotonic())
        waiting = [self._terminal.fileno(), *self._keyboards.filenos(), *others]
        select.select(waiting, [], [], max(min(timeout, self._terminal.longest_wait()), 0.0))
        # the keyboard first: its press explains the character of the terminal
        events = self._keyboards.read(time.monotonic())
        for event in self._terminal.read():
            events += self._matcher.terminal(event)
        return events

    @contextlib.contextmanager
    def paused(self) -> Iterator[None]:
        """Restore the terminal for the duration of a block, as for Ctrl-Z."""
        self._keyboards.close()
        self._matcher.lose_all(time.monotonic())
        with self._terminal.paused():
            yield

    def __enter__(self) -> Self:
        """Open the terminal."""
        self._terminal.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        """Restore the terminal, even after an error."""
        self._keyboards.close()
        self._terminal.__exit__()
