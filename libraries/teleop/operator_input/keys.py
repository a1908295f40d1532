# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What happens to a key: the vocabulary that all sources and users of keys share."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class KeyAction(Enum):
    """What happened to a key."""

    PRESSED = 'pressed'
    """It went down, and its release will be reported."""

    REPEATED = 'repeated'
    """It is still down; the keyboard repeats it."""

    RELEASED = 'released'
    """It went up."""

    TYPED = 'typed'
    """It was pressed or repeated, which of both is not known; its release will not be reported."""

    ALL_RELEASED = 'all released'
    """Whatever was down counts as up: the window lost the focus, or the keyboard is gone."""


@dataclass(frozen=True, slots=True)
class KeyEvent:
    """One thing that happened to a key, on a monotonic clock [s].

    A key is named by the character that it types (``i``, ``I``, ``<``), or ``space``, ``enter``,
    ``tab``, ``escape``, ``backspace``, ``up``, ``down``, ``left``, ``right``, ``home``, ``end``,
    ``page_up``, ``page_down``, ``insert``, ``delete``, ``f1`` to ``f12``; with ``ctrl+`` or
    ``alt+`` before it where these were down. The name is empty for all keys.
    """

    key: str
    action: KeyAction
    time: float

    @property
    def is_stroke(self) -> bool:
        """Whether a person, or the keyboard for them, wants what the key does once (again)."""
        return self.action in {KeyAction.PRESSED, KeyAction.REPEATED, KeyAction.TYPED}


def all_released(time: float) -> KeyEvent:
    """Return the event that lets go of every key."""
    return KeyEvent('', KeyAction.ALL_RELEASED, time)
