# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reading a section of bus.yml by its table of keys."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import difflib
from typing import Any

from ..findings import Findings, RefusedError
from .device_keys import DEVICE_KEYS, DRIVE_KEYS, RPDO_KEYS, SDO_KEYS, TPDO_KEYS
from .document import Item, Scalar, ScalarKind, YamlList, YamlMap
from .master_keys import MASTER_KEYS, OPTION_KEYS
from .scalars import describe
from .schema import Key, Kind, Use

TOP_LEVEL = ('options', 'master', 'defaults', 'nodes')

SECTIONS: dict[str, tuple[Key, ...]] = {
    'options': OPTION_KEYS,
    'master': MASTER_KEYS,
    'a device or defaults': DEVICE_KEYS + DRIVE_KEYS,
    'a number below tpdo': TPDO_KEYS,
    'a number below rpdo': RPDO_KEYS,
    'an entry of sdo': SDO_KEYS,
}
"""Where each key belongs, for remedies."""


def read_section(mapping: YamlMap, keys: Sequence[Key], findings: Findings) -> dict[str, Any]:
    """Check the keys of a section and read those that fill the model.

    Blocks (lists and mappings) are left to their own readers.

    Returns:
        Values in units of the model by field; defaults of the table are filled in.
    """
    check_keys(mapping, keys, findings)
    values: dict[str, Any] = {}
    for key in keys:
        if key.field and key.default is not None:
            values[key.field] = key.to_model(key.default)
        item = mapping.entries.get(key.name)
        if item is None:
            continue
        _read_key(key, item, values, findings)
    return values


def _read_key(key: Key, item: Item, values: dict[str, Any], findings: Findings) -> None:
    try:
        value = None if key.kind is Kind.BLOCK else key.convert(item)
    except RefusedError as reason:
        findings.refuse(item.place, reason)
        return
    is_neutral = value is not None and value == key.neutral
    if key.field:
        values[key.field] = key.to_model(value)
    if key.use is Use.REFUSED and not is_neutral:
        findings.error(
            item.place, f'{describe(item)} is not supported: {key.why}', 'remove the key'
        )
    elif key.use is Use.UNUSED and not is_neutral:
        findings.warning(item.place, f'known, not used yet: {key.why}', 'it may stay')


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
