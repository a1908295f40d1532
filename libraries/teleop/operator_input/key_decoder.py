# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Decodes the bytes of a terminal to key events and reports.

Sources: ECMA-48, section 5.4; xterm's ctlseqs ("PC-Style Function Keys", "VT220-Style Function
Keys"); the Kitty keyboard protocol: ``CSI code:shifted:base ; modifiers:event ; text u``, and for
keys that are older than it ``CSI 1 ; modifiers:event A`` or ``CSI number ; modifiers:event ~``.
"""

from __future__ import annotations

import codecs
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum, IntFlag
import re

from .keys import all_released, KeyAction, KeyEvent

_ESCAPE = '\x1b'
# what is longer than 256 characters is noise
_TOKEN = re.compile(
    r"""
    \x1b (?=\x1b)                                       # the escape key, before a sequence
    | \x1b\[ (?P<parameters>[ -?]{0,256}) (?P<csi>[@-~])
    | \x1b\[ (?: [ -?]{257} | [ -?]{0,256} (?: (?=\x1b) | [^ -~\x1b] ))  # cut off
    | \x1bO (?P<ss3>.)                                  # a function key of the VT100
    | \x1b[P\]X^_]                                      # DCS, OSC, SOS, PM, APC: up to ST or BEL
      (?: [^\x1b\a]{257} | [^\x1b\a]{0,256} (?: (?=\x1b) | \a ))
    | \x1b (?P<alt>[^\[OP\]X^_\x1b])
    | (?P<text>[^\x1b])
    """,
    re.VERBOSE | re.DOTALL,
)
_IS_PASTE_BEGIN = {'200': True, '201': False}  # bracketed paste of xterm: no hand typed it

_SHIFT, _ALT, _CONTROL = 1, 2, 4
_REPEAT, _RELEASE = 2, 3
_PRIVATE = range(0xE000, 0xF900)  # codes of keys that have no character
# locks, Print Screen, Pause, Menu; Shift, Control, Alt and their kin: no keys of their own
_MODIFIER_CODES = frozenset({*range(57358, 57364), *range(57441, 57455)})

_CONTROL_NAMES = {
    '\r': 'enter', '\n': 'enter', '\t': 'tab', '\b': 'backspace', '\x7f': 'backspace',
    _ESCAPE: 'escape', ' ': 'space', '\0': 'ctrl+space',
}  # fmt: skip
_FINAL_NAMES = {
    'A': 'up', 'B': 'down', 'C': 'right', 'D': 'left', 'F': 'end', 'H': 'home',
    'P': 'f1', 'Q': 'f2', 'R': 'f3', 'S': 'f4', 'Z': 'tab',  # with Shift
}  # fmt: skip
_TILDE_NAMES = {
    1: 'home', 2: 'insert', 3: 'delete', 4: 'end',
    5: 'page_up', 6: 'page_down', 7: 'home', 8: 'end',
    11: 'f1', 12: 'f2', 13: 'f3', 14: 'f4', 15: 'f5',
    17: 'f6', 18: 'f7', 19: 'f8', 20: 'f9', 21: 'f10', 23: 'f11', 24: 'f12',
}  # fmt: skip
_KEYPAD = (
    '0 1 2 3 4 5 6 7 8 9 . / * - + enter = , '
    'left right up down page_up page_down home end insert delete'
)
_KEYPAD_NAMES = dict(enumerate(_KEYPAD.split(), 57399))  # they count as those of the main block


class Kitty(IntFlag):
    """Progressive enhancements of the Kitty keyboard protocol (its section of that name)."""

    DISAMBIGUATE = 1
    EVENT_TYPES = 2
    ALTERNATE_KEYS = 4
    ALL_KEYS = 8
    TEXT = 16


NO_FLAGS = Kitty(0)


class ReportKind(Enum):
    """Which question a report answers."""

    KITTY_FLAGS = 'CSI ? u'
    DEVICE_ATTRIBUTES = 'CSI c'
    STATUS = 'CSI 5 n'


@dataclass(frozen=True, slots=True)
class Report:
    """An answer of the terminal; ``flags`` are the active ones of KITTY_FLAGS."""

    kind: ReportKind
    flags: Kitty = NO_FLAGS


class KeyDecoder:
    """Decodes bytes to key events, in every encoding that terminals use. Times are in [s].

    Input may be split at any byte. Pasted text is dropped.
    """

    def __init__(self) -> None:
        # whether the terminal has confirmed to report releases; then a key is PRESSED, otherwise
        # TYPED
        self.reports_releases = False
        self._characters = codecs.getincrementaldecoder('utf-8')('replace')
        self._rest = ''  # begin of a sequence
        self._pasting = False
        self._down: dict[str, str] = {}  # name that a key had when it went down, by its code

    @property
    def is_pending(self) -> bool:
        """Whether an escape byte waits for possible successors; then call flush() soon."""
        return bool(self._rest)

    @property
    def is_holding(self) -> bool:
        """Whether a key is down whose release the terminal will report."""
        return bool(self._down)

    def forget(self) -> None:
        """Reset the keys that are down, as if all were released."""
        self._down.clear()

    def feed(self, data: bytes, now: float) -> list[KeyEvent | Report]:
        """Decode bytes that were read at time ``now``."""
        text, position = self._rest + self._characters.decode(data), 0
        events: list[KeyEvent | Report] = []
        while token := _TOKEN.match(text, position):
            position = token.end()
            if token['csi'] == '~' and token['parameters'] in _IS_PASTE_BEGIN:
                self._pasting = _IS_PASTE_BEGIN[token['parameters']]
            elif not self._pasting:
                events += self._events(token, now)
        self._rest = text[position:]
        return events

    def flush(self, now: float) -> list[KeyEvent | Report]:
        """Decode pending bytes as if none would follow."""
        was, self._rest = self._rest, ''
        is_key = was == _ESCAPE and not self._pasting
        return [KeyEvent('escape', KeyAction.TYPED, now)] if is_key else []

    def _events(self, token: re.Match[str], now: float) -> Iterator[KeyEvent | Report]:
        name = None
        if token['csi']:
            yield from self._sequence(token['parameters'], token['csi'], now)
        elif token['ss3']:
            name = _FINAL_NAMES.get(token['ss3'])
        elif token['alt']:
            name = f'alt+{_character_name(token["alt"])}'
        elif token['text'] or token[0] == _ESCAPE:
            name = _character_name(token[0])
        if name:
            yield KeyEvent(name, KeyAction.TYPED, now)

    def _sequence(self, parameters: str, final: str, now: float) -> Iterator[KeyEvent | Report]:
        is_private = parameters.startswith(('?', '>', '<', '='))
        if final in {'I', 'O'} and not parameters:  # focus came or went, xterm's mode 1004
            if final == 'O':
                self.forget()
                yield all_released(now)
        elif final == 'u' and parameters.startswith('?'):
            flags = _number(parameters[1:], digits=3) or 0
            yield Report(ReportKind.KITTY_FLAGS, Kitty(flags & 31))
        elif final == 'c' and parameters.startswith('?'):
            yield Report(ReportKind.DEVICE_ATTRIBUTES)
        elif final == 'n':
            yield Report(ReportKind.STATUS)
        elif not is_private and (key := _key(parameters, final)) is not None:
            yield from self._key_events(key, now)

    def _key_events(self, key: _Key, now: float) -> Iterator[KeyEvent]:
        before = self._down.get(key.code)
        if key.event == _RELEASE:
            if name := self._down.pop(key.code, key.name):
                yield KeyEvent(name, KeyAction.RELEASED, now)
        elif not key.name:
            return
        elif not self.reports_releases:
            yield KeyEvent(key.name, KeyAction.TYPED, now)
        elif key.event == _REPEAT and before in {key.name, None}:
            if before:  # else it went down before we looked, or all keys were let go of
                yield KeyEvent(key.name, KeyAction.REPEATED, now)
        else:
            if before not in {key.name, None}:  # Shift went down or up meanwhile
                yield KeyEvent(before or '', KeyAction.RELEASED, now)
            self._down[key.code] = key.name
            yield KeyEvent(key.name, KeyAction.PRESSED, now)


@dataclass(frozen=True, slots=True)
class _Key:
    code: str  # identifies the key while it is down, whatever the modifiers do
    name: str  # with its modifiers; empty for a modifier itself or an unknown key
    event: int | None  # 1 press, 2 repeat, 3 release; None where the sequence has none


def _key(parameters: str, final: str) -> _Key | None:
    """Decode a CSI sequence; return None if it is no key."""
    fields = [[_number(part) for part in field.split(':')] for field in parameters.split(';')]
    codes, text = fields[0], _field(fields, 2, 0)
    modifiers = max((_field(fields, 1, 0) or 1) - 1, 0)
    event = _field(fields, 1, 1)
    if final == '~' and codes[0] == 27 and len(fields) > 2:  # xterm's modifyOtherKeys
        codes, text, final = [text], None, 'u'
    if final == 'u':
        if codes[0] is None:
            return None
        name = _character_key_name(codes, modifiers, text)
        return _Key(f'u{codes[0]}', _with_modifiers(name, modifiers) if name else '', event)
    found = _TILDE_NAMES.get(codes[0] or 0) if final == '~' else _FINAL_NAMES.get(final)
    return _Key(found, _with_modifiers(found, modifiers), event) if found else None


def _character_key_name(codes: list[int | None], modifiers: int, text: int | None) -> str:
    """Name a key by the typed character or, if that is not Latin, by the Latin layout."""
    code, shifted, base = (*codes, None, None)[:3]
    if code is None or code in _MODIFIER_CODES:
        return ''
    if code in _PRIVATE:
        return _KEYPAD_NAMES.get(code, '')
    if base is not None and code > 0x7F:
        character = chr(base).upper() if modifiers & _SHIFT else chr(base)
    elif text is not None and text > 0x20 and not modifiers & (_ALT | _CONTROL):
        character = chr(text)
    elif modifiers & _SHIFT:
        character = chr(shifted) if shifted is not None else chr(code).upper()
    else:
        character = chr(code)
    return _character_name(character)


def _character_name(character: str) -> str:
    """Name the key that sends a character; control characters are Control with a letter."""
    if character in _CONTROL_NAMES:
        return _CONTROL_NAMES[character]
    if character < ' ':  # letters are named by their small form
        return f'ctrl+{chr(ord(character) + (0x60 if character < _ESCAPE else 0x40))}'
    return character


def _with_modifiers(name: str, modifiers: int) -> str:
    control = 'ctrl+' if modifiers & _CONTROL and not name.startswith('ctrl+') else ''
    return control + ('alt+' if modifiers & _ALT else '') + name


def _field(fields: list[list[int | None]], index: int, part: int) -> int | None:
    return fields[index][part] if index < len(fields) and part < len(fields[index]) else None


def _number(text: str, digits: int = 7) -> int | None:
    # Python refuses to convert very long numbers
    number = int(text) if text.isascii() and text.isdigit() and len(text) <= digits else None
    # a program can show every character but half of a surrogate pair, and there are no others
    return number if number is None or number < 0xD800 or 0xDFFF < number <= 0x10FFFF else None
