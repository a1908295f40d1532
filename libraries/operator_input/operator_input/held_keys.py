# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which key is held: one state machine for keyboards that report releases and for all others."""

from __future__ import annotations

import math

from .auto_repeat import AutoRepeat
from .keys import KeyAction, KeyEvent


class HeldKeys:
    """The keys that are down, in the order in which they went down. Pure; time comes with events.

    A key that was PRESSED is held until it is RELEASED. A key that was TYPED is held until its
    next character is overdue. The newest key alone counts, so there is never more than one
    command; when it is released, the one before counts again if that is still held. Of typed keys
    only the newest is held at all: the keyboard repeats no other.
    """

    def __init__(self, auto_repeat: AutoRepeat | None = None) -> None:
        """Start with all keys up.

        Args:
            auto_repeat: The time-outs of typed keys.
        """
        self._auto_repeat = auto_repeat or AutoRepeat()
        self._until: dict[str, float] = {}  # [s]; infinite where a release will be reported
        self._typed: tuple[str, float, float] | None = None  # key, its first and last time [s]

    def feed(self, event: KeyEvent) -> None:
        """Take an event.

        Args:
            event: In the order of their times.
        """
        self._expire(event.time)
        match event.action:
            case KeyAction.PRESSED:
                self._press(event.key, math.inf)
            case KeyAction.TYPED:
                self._type(event)
            case KeyAction.RELEASED:
                self._until.pop(event.key, None)
            case KeyAction.ALL_RELEASED:
                self.clear()
            case KeyAction.REPEATED:
                pass  # held already, or let go of by clear() while it was down

    def current(self, now: float) -> str | None:
        """Return the newest key that is held.

        Args:
            now: Time [s].
        """
        held = self.held(now)
        return held[-1] if held else None

    def held(self, now: float) -> tuple[str, ...]:
        """Return all keys that are held, the newest last.

        Args:
            now: Time [s].
        """
        return tuple(key for key, until in self._until.items() if now < until)

    def is_tap(self, now: float) -> bool:
        """Whether the newest key may be up already: it was typed once, and is not repeated yet.

        Args:
            now: Time [s].
        """
        key = self.current(now)
        if key is None or self._typed is None or math.isinf(self._until[key]):
            return False
        _, first, last = self._typed
        return first == last

    def deadline(self, now: float) -> float:
        """Return when a held key is up unless an event of it comes before [s]; may be infinite.

        Args:
            now: Time [s]; the deadline is later.
        """
        return min((until for until in self._until.values() if now < until), default=math.inf)

    def clear(self) -> None:
        """Let go of all keys; one that is down must be pressed again to count."""
        self._until.clear()
        self._typed = None

    def _press(self, key: str, until: float) -> None:
        self._until.pop(key, None)
        self._until[key] = until

    def _type(self, event: KeyEvent) -> None:
        if math.isinf(self._until.get(event.key, 0.0)):
            return  # its release will be reported
        for key in [key for key, until in self._until.items() if not math.isinf(until)]:
            del self._until[key]
        self._press(event.key, event.time + self._time_out(event))

    def _time_out(self, event: KeyEvent) -> float:
        previous, self._typed = self._typed, (event.key, event.time, event.time)
        if previous is None or previous[0] != event.key:
            self._auto_repeat.learn(None)
            return self._auto_repeat.first
        _, first, last = previous
        gap = event.time - last
        self._auto_repeat.learn(gap)
        fresh = gap >= (self._auto_repeat.first if first == last else self._auto_repeat.repeat)
        if fresh or (first == last and self._auto_repeat.is_new_stroke(gap)):
            return self._auto_repeat.first
        self._typed = (event.key, first, event.time)
        return self._auto_repeat.repeat

    def _expire(self, now: float) -> None:
        for key in [key for key, until in self._until.items() if until <= now]:
            del self._until[key]
