# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Key events of the Kitty keyboard protocol.

``CSI code:shifted:base ; modifiers:event ; text u``, and for keys that are older than it
``CSI 1 ; modifiers:event A`` or ``CSI number ; modifiers:event ~``.
"""

from __future__ import annotations

from dataclasses import dataclass

from .key_names import (
    character_name,
    FINAL_NAMES,
    KEYPAD_FIRST,
    KEYPAD_NAMES,
    MODIFIER_CODES,
    TILDE_NAMES,
)
from .tokens import Token

_SHIFT, _ALT, _CONTROL = 1, 2, 4
_PRESS, _REPEAT, _RELEASE = 1, 2, 3
_PRIVATE = range(0xE000, 0xF900)  # codes of keys that have no character


@dataclass(frozen=True, slots=True)
class KittyKey:
    """One sequence, taken apart.

    Attributes:
        code: Identifies the key while it is down, whatever the modifiers do.
        name: Name of the key with its modifiers; empty for a modifier itself or an unknown key.
        event: 1 press, 2 repeat, 3 release; None where the sequence has none.
    """

    code: str
    name: str
    event: int | None

    @property
    def is_repeat(self) -> bool:
        """Whether the keyboard repeats it."""
        return self.event == _REPEAT

    @property
    def is_release(self) -> bool:
        """Whether it went up."""
        return self.event == _RELEASE


def kitty_key(token: Token) -> KittyKey | None:
    """Take a CSI sequence apart.

    Args:
        token: The sequence.

    Returns:
        None if it is no key.
    """
    fields = [
        [_number(part) for part in field.split(':')] for field in token.parameters.split(';')
    ]
    first = fields[0][0]
    modifiers, event = 0, None
    if len(fields) > 1:
        modifiers = max((fields[1][0] or 1) - 1, 0)
        event = fields[1][1] if len(fields[1]) > 1 else None
    if token.final == '~' and first == 27 and len(fields) > 2:  # xterm's modifyOtherKeys
        return _character_key([fields[2][0]], modifiers, None, event)
    if token.final == 'u':
        text = fields[2][0] if len(fields) > 2 else None
        return _character_key(fields[0], modifiers, text, event)
    name = TILDE_NAMES.get(first or 0) if token.final == '~' else FINAL_NAMES.get(token.final)
    if name is None:
        return None
    return KittyKey(name, _with_modifiers(name, modifiers), event)


def _character_key(
    codes: list[int | None], modifiers: int, text: int | None, event: int | None
) -> KittyKey | None:
    code = codes[0]
    if code is None:
        return None
    shifted = codes[1] if len(codes) > 1 else None
    base = codes[2] if len(codes) > 2 else None
    identity = f'u{code}'
    if code in MODIFIER_CODES:
        return KittyKey(identity, '', event)
    if code in _PRIVATE:
        keypad = KEYPAD_NAMES[code - KEYPAD_FIRST : code - KEYPAD_FIRST + 1]
        name = keypad[0] if code >= KEYPAD_FIRST and keypad else ''
        return KittyKey(identity, _with_modifiers(name, modifiers) if name else '', event)
    character = _character(code, shifted, base, modifiers, text)
    return KittyKey(identity, _with_modifiers(character_name(character), modifiers), event)


def _character(
    code: int, shifted: int | None, base: int | None, modifiers: int, text: int | None
) -> str:
    """Choose the character: what was typed, but of the Latin layout where that is not Latin."""
    if base is not None and code > 0x7F:
        letter = chr(base)
        return letter.upper() if modifiers & _SHIFT else letter
    if text is not None and text > 0x20 and not modifiers & (_ALT | _CONTROL):
        return chr(text)
    if modifiers & _SHIFT:
        return chr(shifted) if shifted is not None else chr(code).upper()
    return chr(code)


def _with_modifiers(name: str, modifiers: int) -> str:
    control = 'ctrl+' if modifiers & _CONTROL and not name.startswith('ctrl+') else ''
    alt = 'alt+' if modifiers & _ALT else ''
    return control + alt + name


def _number(text: str) -> int | None:
    # Python refuses to convert very long numbers
    number = int(text) if text.isascii() and text.isdigit() and len(text) <= 7 else None
    # a program can show every character but half of a surrogate pair, and there are no others
    return number if number is None or number < 0xD800 or 0xDFFF < number <= 0x10FFFF else None
