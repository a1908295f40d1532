# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Key events, and the keys that are held, with or without reported releases.

A keyboard repeats a held key: once after a delay (250 ms to 660 ms, the user's setting), then
every 20 ms to 50 ms. A terminal passes on only the characters. So a key without reported release
counts as held until its next character is overdue: first by the delay, later by the interval. The
delay is learned from the first key that is held long enough; until then it is a guess.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from enum import Enum
import math


class KeyAction(Enum):
    """What happened to a key."""

    PRESSED = 'pressed'
    """The key went down; its release will be reported."""

    REPEATED = 'repeated'
    """The key is still down; the keyboard repeats it."""

    RELEASED = 'released'
    """The key went up."""

    TYPED = 'typed'
    """The key was pressed or repeated, which is unknown; its release will not be reported."""

    ALL_RELEASED = 'all released'
    """All keys count as up: the window lost the focus, or the keyboard is gone."""


@dataclass(frozen=True, slots=True)
class KeyEvent:
    """One event of a key, with its time on a monotonic clock in [s].

    A key is named by the character that it types (``i``, ``I``, ``<``), or ``space``, ``enter``,
    ``tab``, ``escape``, ``backspace``, ``up``, ``down``, ``left``, ``right``, ``home``, ``end``,
    ``page_up``, ``page_down``, ``insert``, ``delete``, ``f1`` to ``f12``; with the prefix
    ``ctrl+`` or ``alt+`` if these were down. An empty name means all keys.
    """

    key: str
    action: KeyAction
    time: float

    @property
    def is_stroke(self) -> bool:
        """Whether the event triggers the function of the key: a press or a repeat."""
        return self.action in {KeyAction.PRESSED, KeyAction.REPEATED, KeyAction.TYPED}


def all_released(time: float) -> KeyEvent:
    """Return the event that releases all keys."""
    return KeyEvent('', KeyAction.ALL_RELEASED, time)


FASTEST_DELAY, SLOWEST_DELAY = 0.18, 0.7  # [s] settings of desktops, with a margin
SLOWEST_INTERVAL = 0.1  # [s] between two repeats; what is slower may be a finger
MARGIN = 1.2  # a repeat may come later by this factor


class AutoRepeat:
    """Time-outs of delay and interval in [s], and the learned delay of the keyboard."""

    def __init__(self, first: float = 0.5, repeat: float = 0.15) -> None:
        """Start with guesses for the time after the first character and after each further one.

        Raises:
            ValueError: A time-out is not positive, or the second is longer than the first.
        """
        if not 0 < repeat <= first:
            raise ValueError(f'time-outs {first} s and {repeat} s: wanted 0 < repeat <= first')
        self.repeat = repeat  # longest time between two repeats of a held key
        self._guess = first
        self._delay: float | None = None
        self._gaps: deque[float] = deque(maxlen=3)

    @property
    def first(self) -> float:
        """Time-out after the first character of a key."""
        if self._delay is None:
            return self._guess
        return max(self._delay * MARGIN, self.repeat)

    @property
    def longest(self) -> float:
        """Upper bound of all time-outs of this object."""
        return max(self._guess, SLOWEST_DELAY * MARGIN, self.repeat)

    def is_new_stroke(self, gap: float) -> bool:
        """Return whether a character, ``gap`` [s] after the first of its key, is a new press.

        Only a learned delay can decide: a character long before it is no repeat.
        """
        return self._delay is not None and self.repeat < gap < self._delay / MARGIN

    def learn(self, gap: float | None) -> None:
        """Learn from the time since the same character; None if the previous one was different."""
        if gap is None:
            self._gaps.clear()
            return
        self._gaps.append(gap)
        if len(self._gaps) == self._gaps.maxlen:
            delay, *repeats = self._gaps
            if FASTEST_DELAY < delay < SLOWEST_DELAY and max(repeats) < SLOWEST_INTERVAL:
                self._delay = delay


class HeldKeys:
    """The keys that are down, in the order in which they went down. Pure; times are in [s].

    A key that was PRESSED is held until it is RELEASED. A key that was TYPED is held until its
    next character is overdue. Only the newest key counts, so there is never more than one command;
    when it is released, the previous one counts again if it is still held. Of typed keys, only the
    newest is held: the keyboard repeats no other.
    """

    def __init__(self, auto_repeat: AutoRepeat | None = None) -> None:
        self._auto_repeat = auto_repeat or AutoRepeat()
        self._until: dict[str, float] = {}  # infinite where a release will be reported
        self._typed: tuple[str, float, float] | None = None  # key, its first and last time

    def feed(self, event: KeyEvent) -> None:
        """Process an event; events must be in order of time."""
        for key in [key for key, until in self._until.items() if until <= event.time]:
            del self._until[key]
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
        """Return the newest key that is held."""
        return next(reversed(self.held(now)), None)

    def held(self, now: float) -> tuple[str, ...]:
        """Return all keys that are held, the newest last."""
        return tuple(key for key, until in self._until.items() if now < until)

    def is_tap(self, now: float) -> bool:
        """Whether the newest key may be up already: typed once, and not repeated yet."""
        key = self.current(now)
        if key is None or self._typed is None or math.isinf(self._until[key]):
            return False
        _, first, last = self._typed
        return first == last

    def deadline(self, now: float) -> float:
        """Return when a held key expires without a further event; may be infinite."""
        return min((until for until in self._until.values() if now < until), default=math.inf)

    def clear(self) -> None:
        """Release all keys; one that is down must be pressed again to count."""
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
