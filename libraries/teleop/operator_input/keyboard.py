# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The keyboard of a person: keys from a terminal, releases from wherever they are known."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
import contextlib
from enum import Enum
import os
import select
import time
from typing import TYPE_CHECKING

from .devices import InputDevices
from .keys import KeyEvent
from .releases import is_local, Keyboards, ReleaseMatcher
from .status import StatusLine
from .terminal import CONTROLLING_TERMINAL, Stage, TerminalKeyboard

if TYPE_CHECKING:
    from typing_extensions import Self


class ReleaseSource(Enum):
    """Source of key releases."""

    TERMINAL = 'terminal'
    """The Kitty keyboard protocol."""

    KEYBOARD = 'keyboard'
    """The keyboard itself, by evdev."""

    TIME_OUT = 'time-out'
    """No source; a key is up when its next repeat is overdue."""


class Keyboard:
    """Key events of a person, with true releases where the machine has any."""

    def __init__(
        self,
        path: str = CONTROLLING_TERMINAL,
        *,
        devices: InputDevices | None = None,
        environment: Mapping[str, str] = os.environ,
        kitty: bool = True,
        evdev: bool = True,
    ) -> None:
        """Prepare; the terminal is touched on entering the context.

        Args:
            path: Device of the terminal.
            devices: Input devices; those of this machine when it is None.
            environment: Shows whether the terminal is on this machine.
            kitty: Use the releases that the terminal reports.
            evdev: Use those of this machine's keyboards, if the terminal has none.
        """
        self._terminal = TerminalKeyboard(path, kitty=kitty)
        self._matcher = ReleaseMatcher()
        self._keyboards = Keyboards(devices or InputDevices(), self._matcher)
        self._watch_keyboards = evdev and is_local(environment)

    @property
    def release_source(self) -> ReleaseSource:
        """Source of key releases at the moment."""
        if self._terminal.stage is Stage.ACTIVE:
            return ReleaseSource.TERMINAL
        return ReleaseSource.KEYBOARD if self._keyboards.names else ReleaseSource.TIME_OUT

    def status_line(self) -> StatusLine:
        """Return a status line on the same terminal."""
        return StatusLine(self._terminal)

    def wait(self, timeout: float, others: Iterable[int] = ()) -> list[KeyEvent]:
        """Wait for something to happen to a key.

        Args:
            timeout: Longest wait [s].
            others: File descriptors that end the wait too.

        Returns:
            What happened, in its order; empty after the time-out.

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
        """Give the terminal back for the time of a block, as for Ctrl-Z."""
        self._keyboards.close()
        self._matcher.lose_all(time.monotonic())
        with self._terminal.paused():
            yield

    def __enter__(self) -> Self:
        """Open the terminal."""
        self._terminal.__enter__()
        return self

    def __exit__(self, *_: object) -> None:
        """Give the terminal back, whatever happened."""
        self._keyboards.close()
        self._terminal.__exit__()
