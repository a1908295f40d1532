# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reading a section of bus.yml by its table of keys, with the traps of YAML 1.1 handled.

YAML 1.1 reads ``off`` as false, ``010`` as 8, ``1:30`` as 90 and ``1e-5`` as text. A value with a
clear meaning is accepted; others are refused with a remedy. Readers of one value raise a
RefusedError; readers of a section add it to the findings.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import difflib
from functools import partial
import math
import re
from typing import Any, TypeVar

from canopen_core import Findings, RefusedError

from ..keys import Key, Kind, Use
from ..sections import SECTIONS, TOP_LEVEL
from .document import Item, Scalar, ScalarKind, YamlList, YamlMap

T = TypeVar('T')

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
    """Return the item as a scalar; refuse a list, a mapping or an empty value."""
    if isinstance(item, Scalar) and item.kind is not ScalarKind.NULL:
        return item
    raise RefusedError(
        f'expected {wanted}, got {describe(item)}', f'write {wanted} behind the key'
    )


def key_number(name: str, high: int) -> int | None:
    """Return a key as a number from 0 to ``high``, None for any other key."""
    if name.isascii() and name.isdecimal() and len(name) <= len(str(high)) and int(name) <= high:
        return int(name)
    return None


def integer(item: Item) -> int:
    """Read a whole number: decimal, ``0x`` hexadecimal or ``0b`` binary, quoted or not.

    Refuse ``010``, which YAML reads as octal.
    """
    value = scalar(item, 'a whole number')
    text = value.text.strip()
    decimal = text.replace('_', '')[:NUMBER_LENGTH_MAX]
    if LEADING_ZERO.fullmatch(text) and abs(int(decimal)) > 7:
        raise RefusedError(
            f'{text} is ambiguous: YAML reads a leading zero as octal',
            f'write {int(decimal)}, or 0x... for hexadecimal',
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


def _whole(text: str) -> int:
    if len(text) > NUMBER_LENGTH_MAX:
        raise ValueError(text)
    try:
        return int(text, 10 if LEADING_ZERO.fullmatch(text) else 0)
    except ValueError:
        number = float(text)  # 10.0 and 1e3 are whole numbers, too
        if not number.is_integer():
            raise
        return int(number)


def number(item: Item) -> float:
    """Read a finite number; accept ``1e-5``, which is text in YAML 1.1."""
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
    """Read true, yes, on, 1 or their opposites; refuse quotes: loaders take "false" for true."""
    value = scalar(item, 'true or false')
    word = value.text.lower()
    if not value.quoted and word in TRUE_WORDS | FALSE_WORDS:
        return word in TRUE_WORDS
    quotes = ' without quotes' if value.quoted else ''
    raise RefusedError(
        f'expected true or false, got {describe(item)}', f'write true or false{quotes}'
    )


def text(item: Item) -> str:
    """Read a text; refuse an unquoted value that YAML reads as another type."""
    value = scalar(item, 'a text')
    if value.kind is ScalarKind.TEXT or value.quoted:
        return value.text
    raise RefusedError(
        f'expected a text, got {describe(item)}', f"put it in quotes: '{value.text}'"
    )


def attempt(reader: Callable[[Item], T], item: Item, findings: Findings) -> T | None:
    """Read a value; if the reader refuses it, add that to the findings and return None."""
    try:
        return reader(item)
    except RefusedError as reason:
        findings.refuse(item.place, reason)
        return None


CONVERTERS: dict[Kind | None, Callable[[Item], Any]] = {
    Kind.INTEGER: integer,
    Kind.NUMBER: number,
    Kind.BOOLEAN: boolean,
    Kind.TEXT: text,
}


def read_section(mapping: YamlMap, keys: Sequence[Key], findings: Findings) -> dict[str, Any]:
    """Check the keys of a section; return the values present by field, in units of the model.

    Blocks (lists and mappings) have their own readers.
    """
    check_keys(mapping, keys, findings)
    values: dict[str, Any] = {}
    for key in keys:
        item = mapping.entries.get(key.name)
        if item is not None:
            _read_key(key, item, values, findings)
    return values


def _read_key(key: Key, item: Item, values: dict[str, Any], findings: Findings) -> None:
    if key.kind is not Kind.BLOCK:
        value = attempt(partial(convert, key), item, findings)
        if value is None:
            return
        if key.is_kept:
            values[key.field] = value if key.unit is None else value / key.unit
        if value == key.default:
            return
    if key.use is Use.REFUSED:
        findings.error(
            item.place, f'{describe(item)} is not supported: {key.why}', 'remove the key'
        )
    elif key.use is Use.UNUSED:
        findings.warning(item.place, f'known, not used yet: {key.why}', 'it may stay')


def convert(key: Key, item: Item) -> Any:  # noqa: ANN401  # the kind decides
    """Return a value in units of the file; refuse a wrong type or a value out of range."""
    value, why = CONVERTERS[key.kind](item), f'; {key.why}' if key.why else ''
    if key.form is not None and not key.form.fullmatch(value):
        raise RefusedError(f'{value!r} is no {key.text}', key.why)
    if key.choices is not None and value not in key.choices:
        known = ', '.join(f'{number} {title}' for number, title in key.choices.items())
        raise RefusedError(f'{describe(item)} is not allowed here', f'take one of: {known}{why}')
    if not _in_range(key, value):
        wanted = 'a value other than 0'
        if key.span is not None:
            low, high = key.span
            wanted = f'{"0 or " if key.zero else ""}{low:g} to {high:g}'
        raise RefusedError(f'{describe(item)} is out of range', f'take {wanted}{why}')
    return value


def _in_range(key: Key, value: float | str) -> bool:
    if isinstance(value, str):
        return True
    if value == 0 and key.zero is not None:
        return key.zero
    return key.span is None or key.span[0] <= value <= key.span[1]


def check_keys(mapping: YamlMap, keys: Iterable[Key], findings: Findings) -> None:
    """Refuse unknown keys, with a suggestion for each."""
    names = [key.name for key in keys]
    for name, item in mapping.entries.items():
        if name not in names:
            findings.error(item.place, f'unknown key {name!r}', remedy_for(name, names))


def remedy_for(name: str, names: Sequence[str]) -> str:
    """Suggest a similar key for an unknown one, or the section where it belongs."""
    if name in TOP_LEVEL:
        return f'{name!r} belongs to the top level; indent it less'
    for section, keys in SECTIONS.items():
        if any(key.name == name for key in keys):
            return f'{name!r} belongs to {section}; check the indentation'
    close = difflib.get_close_matches(name, names, n=1) or [
        known for known in names if known.startswith(name)
    ]
    if close:
        return f'did you mean {close[0]!r}?'
    return f'remove it; known here: {", ".join(names)}'


def block(mapping: YamlMap, name: str, findings: Findings) -> YamlMap | None:
    """Return a mapping within a section, None if it is absent or not a mapping."""
    wanted = 'keys with values', f'indent the keys of {name!r} below it, or remove it'
    return _part(mapping, name, YamlMap, wanted, findings)


def listing(mapping: YamlMap, name: str, findings: Findings) -> YamlList | None:
    """Return a list within a section, None if it is absent or not a list."""
    remedy = "write entries as '- {index: 0x6040, sub_index: 0}' below it, or remove it"
    return _part(mapping, name, YamlList, ('a list', remedy), findings)


def _part(
    mapping: YamlMap, name: str, kind: type[T], wanted: tuple[str, str], findings: Findings
) -> T | None:
    item = mapping.entries.get(name)
    if item is not None and not isinstance(item, kind):
        expected, remedy = wanted
        findings.error(item.place, f'expected {expected}, got {describe(item)}', remedy)
        return None
    return item


def texts(mapping: YamlMap, name: str, findings: Findings) -> dict[str, str]:
    """Read a mapping from text to text, such as ``remappings``."""
    section = block(mapping, name, findings)
    result: dict[str, str] = {}
    for key, item in section.entries.items() if section else ():
        if (value := attempt(text, item, findings)) is not None:
            result[key] = value
    return result
