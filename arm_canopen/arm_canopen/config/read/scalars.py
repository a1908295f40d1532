# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reading scalars as values, with the traps of YAML 1.1 said by name.

YAML 1.1 reads ``off`` as false, ``010`` as 8, ``1:30`` as 90 and ``1e-5`` as text. Where the
meaning is beyond doubt the value is taken, elsewhere it is refused with what to write instead.
"""

from __future__ import annotations

import math
import re

from canopen_core import RefusedError

from .document import Item, Scalar, ScalarKind, YamlList

TRUE_WORDS = frozenset({'true', 'yes', 'on', 'y', '1'})
FALSE_WORDS = frozenset({'false', 'no', 'off', 'n', '0'})
LEADING_ZERO = re.compile(r'[-+]?0[0-9_]+')
SEXAGESIMAL = re.compile(r'[-+]?[0-9][0-9_]*(:[0-5]?[0-9])+')
NUMBER_LENGTH_MAX = 80  # longer than any 64-bit number in any notation


def describe(item: Item) -> str:
    """Describe a value for messages."""
    if isinstance(item, YamlList):
        return 'a list'
    if not isinstance(item, Scalar):
        return 'a mapping'
    if item.kind is ScalarKind.NULL:
        return 'nothing'
    if item.kind is ScalarKind.BOOLEAN and item.text.lower() not in ('true', 'false'):
        return f'{item.text!r} (YAML reads it as a boolean)'
    text = item.text if len(item.text) <= 60 else f'{item.text[:57]}...'
    return repr(text) if item.kind is ScalarKind.TEXT else text


def scalar(item: Item, wanted: str) -> Scalar:
    """Return a value that is neither a list nor a mapping nor empty.

    Raises:
        RefusedError: It is.
    """
    if isinstance(item, Scalar) and item.kind is not ScalarKind.NULL:
        return item
    raise RefusedError(
        f'expected {wanted}, got {describe(item)}', f'write {wanted} behind the key'
    )


def key_number(name: str, high: int) -> int | None:
    """Return a key that is a number of 0 to ``high``, None for any other."""
    if name.isascii() and name.isdecimal() and len(name) <= len(str(high)) and int(name) <= high:
        return int(name)
    return None


def integer(item: Item) -> int:
    """Read a whole number: decimal, ``0x`` hexadecimal or ``0b`` binary; quotes do not matter.

    Raises:
        RefusedError: It is none, or one that people and YAML read differently (``010``).
    """
    value = scalar(item, 'a whole number')
    text = value.text.strip()
    if LEADING_ZERO.fullmatch(text) and abs(decimal := _decimal(text)) > 7:
        raise RefusedError(
            f'{text} is ambiguous: YAML reads a leading zero as octal',
            f'write {decimal}, or 0x... for hexadecimal',
        )
    if SEXAGESIMAL.fullmatch(text):
        raise RefusedError(
            f'{text} is ambiguous: YAML reads it in base 60', 'write a plain number'
        )
    try:
        return _whole(text)
    except ValueError:
        raise RefusedError(
            f'expected a whole number, got {describe(item)}', 'write it as 10 or 0x0A'
        ) from None


def _decimal(text: str) -> int:
    return int(text.replace('_', '')[:NUMBER_LENGTH_MAX])


def _whole(text: str) -> int:
    if len(text) > NUMBER_LENGTH_MAX:
        raise ValueError(text)
    if LEADING_ZERO.fullmatch(text):
        return _decimal(text)
    try:
        return int(text, 0)
    except ValueError:
        number = float(text)  # 10.0 and 1e3 are whole numbers, too
        if not number.is_integer():
            raise
        return int(number)


def number(item: Item) -> float:
    """Read a finite number; ``1e-5`` without a point counts, although YAML 1.1 takes it for text.

    Raises:
        RefusedError: It is none.
    """
    value = scalar(item, 'a number')
    try:
        result = float(_whole(value.text.strip()) if 'x' in value.text else value.text)
    except ValueError:
        raise RefusedError(
            f'expected a number, got {describe(item)}', 'write it as 10, 0.5 or 1.0e-3'
        ) from None
    if math.isfinite(result):
        return result
    raise RefusedError(f'{value.text} is not a finite number', 'write a finite one')


def boolean(item: Item) -> bool:
    """Read a boolean: true, yes, on, 1 and their opposites.

    Raises:
        RefusedError: It is none; text in quotes never is, as loaders take "false" for true.
    """
    value = scalar(item, 'true or false')
    word = value.text.lower()
    if not value.quoted and word in TRUE_WORDS | FALSE_WORDS:
        return word in TRUE_WORDS
    quotes = ' without quotes' if value.quoted else ''
    raise RefusedError(
        f'expected true or false, got {describe(item)}', f'write true or false{quotes}'
    )


def text(item: Item) -> str:
    """Read a text.

    Raises:
        RefusedError: It is a list, a mapping or nothing, or YAML takes it for something else.
    """
    value = scalar(item, 'a text')
    if value.kind is ScalarKind.TEXT or value.quoted:
        return value.text
    raise RefusedError(
        f'expected a text, got {describe(item)}', f"put it in quotes: '{value.text}'"
    )
