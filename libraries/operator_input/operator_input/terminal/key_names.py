# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Names of the keys in what terminals send.

Sources: xterm's ctlseqs ("PC-Style Function Keys", "VT220-Style Function Keys"); the Kitty
keyboard protocol, section "Functional key definitions".
"""

from __future__ import annotations

ESCAPE = '\x1b'

CONTROL_NAMES = {
    '\r': 'enter',
    '\n': 'enter',
    '\t': 'tab',
    '\b': 'backspace',
    '\x7f': 'backspace',
    '\x1b': 'escape',
    ' ': 'space',
    '\0': 'ctrl+space',
}
"""Characters that are no names of keys."""

FINAL_NAMES = {
    'A': 'up',
    'B': 'down',
    'C': 'right',
    'D': 'left',
    'F': 'end',
    'H': 'home',
    'P': 'f1',
    'Q': 'f2',
    'R': 'f3',
    'S': 'f4',
    'Z': 'tab',  # with Shift
}
"""Keys that the last character of CSI or SS3 names."""

TILDE_NAMES = {
    1: 'home',
    2: 'insert',
    3: 'delete',
    4: 'end',
    5: 'page_up',
    6: 'page_down',
    7: 'home',
    8: 'end',
    **{11 + index: f'f{1 + index}' for index in range(5)},
    **{17 + index: f'f{6 + index}' for index in range(5)},
    23: 'f11',
    24: 'f12',
}
"""Keys that the first number before a tilde names."""

KEYPAD_FIRST = 57399
"""Code of the key 0 of the keypad; those of KEYPAD_NAMES follow."""

KEYPAD_NAMES = (
    *'0123456789./*-+',
    'enter',
    '=',
    ',',
    'left',
    'right',
    'up',
    'down',
    'page_up',
    'page_down',
    'home',
    'end',
    'insert',
    'delete',
)
"""Keys of the keypad in the order of their codes: they count as those of the main block."""

MODIFIER_CODES = frozenset({*range(57358, 57364), *range(57441, 57455)})
"""Locks, Print Screen, Pause, Menu; Shift, Control, Alt and their kin: no keys of their own."""


def character_name(character: str) -> str:
    """Name the key that sends a character.

    Args:
        character: One character; control characters are Control with a letter.
    """
    if character in CONTROL_NAMES:
        return CONTROL_NAMES[character]
    if character < ' ':
        base = 0x60 if character < ESCAPE else 0x40  # letters are named by their small form
        return f'ctrl+{chr(ord(character) + base)}'
    return character
