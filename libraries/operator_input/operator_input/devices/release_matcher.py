# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Finds out when a key that was typed in a terminal goes up, from what the keyboard itself says.

The keyboard knows nothing of windows and layouts, so it is never read for what was pressed: that
comes from the terminal, which has the focus. A character belongs to the key that went down just
before it (or just after, when the two reports overtake each other); that key going up is its
release. This is right for every layout, and what is typed elsewhere is never taken for a command.
"""

from __future__ import annotations

from ..keys import KeyAction, KeyEvent

WINDOW = 0.25  # [s] by which a terminal may report a character later than the keyboard
OVERTAKEN = 0.05  # [s] by which it may report it earlier, as we read it
# Control, Shift, Alt, Meta and the locks type nothing (KEY_LEFTCTRL ... KEY_RIGHTMETA)
MODIFIERS = frozenset({29, 42, 54, 56, 58, 69, 70, 97, 100, 125, 126})


class ReleaseMatcher:
    """Joins the events of a terminal and of keyboards; pure, time comes with the events."""

    def __init__(self) -> None:
        self._down: dict[int, float] = {}  # when each key went down [s], as long as it is down
        self._tapped: tuple[int, float] | None = None  # the last one that went up unmatched
        self._matched: dict[int, str] = {}  # the name of each key that is down
        self._last_typed: KeyEvent | None = None  # not matched yet

    def key_down(self, code: int, now: float) -> list[KeyEvent]:
        """Take a key of a keyboard that went down.

        Args:
            code: Its code.
            now: Time [s].

        Returns:
            A press, if its character has come already; its release, if it was down.
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
        """Take a key of a keyboard that went up.

        Args:
            code: Its code.
            now: Time [s].

        Returns:
            The release of its character, if that is known.
        """
        went_down = self._down.pop(code, None)
        name = self._matched.pop(code, None)
        if name is not None:
            return [KeyEvent(name, KeyAction.RELEASED, now)]
        if went_down is not None:
            self._tapped = (code, went_down)
        return []

    def terminal(self, event: KeyEvent) -> list[KeyEvent]:
        """Take an event of the terminal.

        Args:
            event: Any; one that is TYPED may become PRESSED or REPEATED.
        """
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
        """Take the loss of a keyboard: its keys will not be reported as released.

        Args:
            now: Time [s].
        """
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
