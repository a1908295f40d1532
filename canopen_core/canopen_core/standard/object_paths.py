# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Objects as people name them: by number or by the names of the EDS.

========================================  =======================================
``0x6041``, ``6041``                      a VAR, or sub-index 0
``0x607D:02``, ``0x607D:2``               a sub-index
``Statusword``                            by name, in upper or lower case
``Software position limit/Max position``  a sub-index by the names of record and entry,
                                          which may be shortened as long as they are clear
========================================  =======================================
"""

from __future__ import annotations

import difflib
import re

from ..exceptions import ObjectError
from .dictionary import object_address, ObjectDictionary, ObjectEntry

NUMBER = re.compile(r'(?:0x)?([0-9a-f]{4})(?::(?:0x)?([0-9a-f]{1,2}))?', re.IGNORECASE)
SIMILAR_MAX = 4


def find_object(dictionary: ObjectDictionary, path: str) -> ObjectEntry:
    """Find an object by number or name, as described above.

    Raises:
        ObjectError: There is none, or there are several; the message names the candidates.
    """
    number = NUMBER.fullmatch(path.strip())
    if number is not None:
        return _by_number(dictionary, int(number[1], 16), int(number[2] or '0', 16))
    return _by_name(dictionary, path)


def object_path(entry: ObjectEntry) -> str:
    """Return the name by which an object is found."""
    return f'{entry.record}/{entry.name}' if entry.record else entry.name


def _by_number(dictionary: ObjectDictionary, index: int, subindex: int) -> ObjectEntry:
    entry = dictionary.get(index, subindex)
    if entry is not None:
        return entry
    others = dictionary.subindices(index)
    if not others:
        raise ObjectError(f'there is no object {object_address(index)} in {dictionary.source}')
    names = ', '.join(str(other) for other in others)
    raise ObjectError(
        f'{object_address(index)} has no sub-index 0x{subindex:02X}; it has: {names}'
    )


def _by_name(dictionary: ObjectDictionary, path: str) -> ObjectEntry:
    wanted = _words(path)
    if not wanted.strip('/'):
        raise ObjectError('no object is named; write a number as 0x6041 or 0x607D:02, or a name')
    by_path: dict[str, list[ObjectEntry]] = {}
    for entry in dictionary:
        by_path.setdefault(_words(object_path(entry)), []).append(entry)
    found = by_path.get(wanted, [])
    if not found:
        found = [e for name, entries in by_path.items() if _begins(name, wanted) for e in entries]
    if len(found) == 1:
        return found[0]
    if found:
        raise ObjectError(f'{path!r} may be any of {_listed(found)}')
    close = difflib.get_close_matches(wanted, by_path, n=SIMILAR_MAX)
    similar = [entry for name in close for entry in by_path[name]]
    hint = f'; similar: {_listed(similar)}' if similar else ''
    raise ObjectError(f'there is no object {path!r} in {dictionary.source}{hint}')


def _words(path: str) -> str:
    return '/'.join(' '.join(part.split()).lower() for part in path.split('/'))


def _begins(name: str, wanted: str) -> bool:
    """Whether each part of the wanted name begins that of a name, a lone part any of them."""
    parts, begins = name.split('/'), wanted.split('/')
    if len(begins) == 1:
        return any(part.startswith(wanted) for part in parts)
    return len(parts) == len(begins) and all(
        part.startswith(begin) for part, begin in zip(parts, begins, strict=True)
    )


def _listed(entries: list[ObjectEntry]) -> str:
    shown = [
        f'{object_address(e.index, e.subindex)} {object_path(e)}' for e in entries[:SIMILAR_MAX]
    ]
    more = len(entries) - len(shown)
    return ', '.join(shown) + (f' and {more} more' if more else '')
