# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reading a section of bus.yml by its table of keys."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
import difflib
from typing import Any

from canopen_core import Findings, RefusedError

from ..keys import Key, Kind, Use
from ..sections import SECTIONS, TOP_LEVEL
from . import scalars
from .document import Item, Scalar, ScalarKind, YamlList, YamlMap
from .scalars import describe

CONVERTERS: dict[Kind | None, Callable[[Item], Any]] = {
    Kind.INTEGER: scalars.integer,
    Kind.NUMBER: scalars.number,
    Kind.BOOLEAN: scalars.boolean,
    Kind.TEXT: scalars.text,
}


def read_section(mapping: YamlMap, keys: Sequence[Key], findings: Findings) -> dict[str, Any]:
    """Check the keys of a section, and return the given values in units of the model by field.

    Blocks (lists and mappings) are left to their own readers.
    """
    check_keys(mapping, keys, findings)
    values: dict[str, Any] = {}
    for key in keys:
        item = mapping.entries.get(key.name)
        if item is not None:
            _read_key(key, item, values, findings)
    return values


def _read_key(key: Key, item: Item, values: dict[str, Any], findings: Findings) -> None:
    try:
        value: Any = None if key.kind is Kind.BLOCK else convert(key, item)
    except RefusedError as reason:
        findings.refuse(item.place, reason)
        return
    if key.is_kept:
        values[key.field] = value if key.unit is None else value / key.unit
    if value is not None and value == key.default:
        return
    if key.use is Use.REFUSED:
        findings.error(
            item.place, f'{describe(item)} is not supported: {key.why}', 'remove the key'
        )
    elif key.use is Use.UNUSED:
        findings.warning(item.place, f'known, not used yet: {key.why}', 'it may stay')


def convert(key: Key, item: Item) -> Any:  # noqa: ANN401  # the kind decides
    """Return a value in units of the file.

    Raises:
        RefusedError: It is of another kind or out of range.
    """
    value, why = CONVERTERS[key.kind](item), f'; {key.why}' if key.why else ''
    if key.choices is not None and value not in key.choices:
        known = ', '.join(f'{number} {title}' for number, title in key.choices.items())
        raise RefusedError(f'{value} is not allowed here', f'take one of: {known}{why}')
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
    """Refuse keys that are not in a table, with a guess at what was meant."""
    names = [key.name for key in keys]
    for name, item in mapping.entries.items():
        if name not in names:
            findings.error(item.place, f'unknown key {name!r}', remedy_for(name, names))


def remedy_for(name: str, names: Sequence[str]) -> str:
    """Guess what an unknown key was meant to be, or where it belongs."""
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
    """Return a section within a section, None when it is absent or of the wrong kind."""
    item = mapping.entries.get(name)
    if item is None or isinstance(item, YamlMap):
        return item
    findings.error(
        item.place,
        f'expected keys with values, got {describe(item)}',
        f'indent the keys of {name!r} below it, or remove it',
    )
    return None


def listing(mapping: YamlMap, name: str, findings: Findings) -> YamlList | None:
    """Return a list within a section, None when it is absent or of the wrong kind."""
    item = mapping.entries.get(name)
    if item is None or isinstance(item, YamlList):
        return item
    findings.error(
        item.place,
        f'expected a list, got {describe(item)}',
        "write entries as '- {index: 0x6040, sub_index: 0}' below it, or remove it",
    )
    return None


def texts(mapping: YamlMap, name: str, findings: Findings) -> dict[str, str]:
    """Read a mapping from text to text, such as ``remappings``."""
    section = block(mapping, name, findings)
    result: dict[str, str] = {}
    for key, item in section.entries.items() if section else ():
        if isinstance(item, Scalar) and item.kind is ScalarKind.TEXT:
            result[key] = item.text
        else:
            findings.error(
                item.place, f'expected a text, got {describe(item)}', 'put it in quotes'
            )
    return result
