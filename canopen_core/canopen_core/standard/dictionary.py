# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The object dictionary of a device (CiA 301, 7.4): descriptions of objects, not present values.

Users name an object by its number or by its name in the EDS:

========================================  =======================================
``0x6041``, ``6041``                      a VAR, or sub-index 0
``0x607D:02``, ``0x607D:2``               a sub-index
``Statusword``                            by name, in upper or lower case
``Software position limit/Max position``  a sub-index by the names of record and entry,
                                          which may be shortened as long as unambiguous
========================================  =======================================
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
import difflib
from enum import Enum, IntEnum
import re

from ..exceptions import ObjectError
from .datatypes import DataType, Value
from .messages import own_cob_id
from .objects import AXES_MAX, AXIS_OFFSET, Index


def object_address(index: int, subindex: int | None = None) -> str:
    """Return the address of an object for messages: ``0x607D:02``, or ``0x607D`` as a whole."""
    return f'0x{index:04X}' if subindex is None else f'0x{index:04X}:{subindex:02X}'


class AccessType(Enum):
    """Who may read or write an object (CiA 306-1, AccessType)."""

    READ_ONLY = 'ro'
    WRITE_ONLY = 'wo'
    READ_WRITE = 'rw'
    READ_WRITE_TPDO = 'rwr'
    READ_WRITE_RPDO = 'rww'
    CONSTANT = 'const'

    @property
    def readable(self) -> bool:
        """Whether an SDO upload is allowed."""
        return self is not AccessType.WRITE_ONLY

    @property
    def writable(self) -> bool:
        """Whether an SDO download is allowed."""
        return self not in (AccessType.READ_ONLY, AccessType.CONSTANT)


class ObjectCode(IntEnum):
    """Kind of an object (CiA 301, table 42)."""

    NULL = 0
    DOMAIN = 2
    DEFTYPE = 5
    DEFSTRUCT = 6
    VAR = 7
    ARRAY = 8
    RECORD = 9


@dataclass(frozen=True, slots=True)
class ObjectEntry:
    """One sub-index of the object dictionary."""

    index: int
    subindex: int  # sub-index, 0 for a VAR
    name: str  # ParameterName of the EDS
    data_type: DataType
    access: AccessType = AccessType.READ_WRITE
    # value after a reset, of a configured device in a DCF; None when there is none
    default: Value | None = None
    node_relative: bool = False  # the default is to be added to the node id (``$NODEID+...``)
    low_limit: int | float | None = None  # smallest allowed value, None for the type's own
    high_limit: int | float | None = None  # largest allowed value, None for the type's own
    pdo_mappable: bool = False  # may be mapped into a PDO
    line: int = 0  # line of the EDS that defines it, 0 when it comes from elsewhere
    record: str = ''  # ParameterName of the array or record that it belongs to, empty for a VAR
    configured: bool = False  # a DCF gives it this value, which is not the one after a reset
    # COB-ID of the file, where that leaves out ``$NODEID`` and the default has it; None otherwise
    literal: int | None = None

    @property
    def address(self) -> tuple[int, int]:
        """Index and sub-index."""
        return self.index, self.subindex

    @property
    def tpdo_mappable(self) -> bool:
        """May be mapped into a TPDO (CiA 306-1, AccessType: all but ``wo`` and ``rww``)."""
        return self.pdo_mappable and self.access not in (
            AccessType.WRITE_ONLY,
            AccessType.READ_WRITE_RPDO,
        )

    @property
    def rpdo_mappable(self) -> bool:
        """May be mapped into an RPDO (CiA 306-1, AccessType: ``rw``, ``rww`` and ``wo``)."""
        return self.pdo_mappable and self.access in (
            AccessType.WRITE_ONLY,
            AccessType.READ_WRITE,
            AccessType.READ_WRITE_RPDO,
        )

    def __str__(self) -> str:
        """Return address and name: ``0x6041:00 Statusword``."""
        return f'{object_address(self.index, self.subindex)} {self.name}'


class ObjectDictionary:
    """All entries of a device by index and sub-index, in ascending order."""

    def __init__(
        self,
        entries: Iterable[ObjectEntry],
        *,
        source: str = 'object dictionary',
        node_id: int | None = None,
    ) -> None:
        """Collect the entries; of two with the same address the later one is used."""
        self.source = source  # where it was read from, for messages
        self.node_id = node_id  # node id for which its COB-IDs are, None where no file says that
        ordered = sorted(entries, key=lambda entry: entry.address)
        self._entries = {entry.address: entry for entry in ordered}
        self._by_index: dict[int, list[ObjectEntry]] = {}
        for entry in self:
            self._by_index.setdefault(entry.index, []).append(entry)

    def __iter__(self) -> Iterator[ObjectEntry]:
        """Iterate in ascending order of index and sub-index."""
        return iter(self._entries.values())

    def __len__(self) -> int:
        """Count the entries."""
        return len(self._entries)

    def __contains__(self, address: tuple[int, int]) -> bool:
        """Return whether the sub-index exists."""
        return address in self._entries

    def get(self, index: int, subindex: int = 0) -> ObjectEntry | None:
        """Return the entry, or None if the device has no such object."""
        return self._entries.get((index, subindex))

    def number(self, index: int, subindex: int = 0) -> int | None:
        """Return the integer default of an object; None if it has none."""
        entry = self.get(index, subindex)
        return entry.default if entry is not None and isinstance(entry.default, int) else None

    def has_index(self, index: int) -> bool:
        """Return whether any sub-index of this index exists."""
        return index in self._by_index

    def subindices(self, index: int) -> list[ObjectEntry]:
        """Return all entries of one index, ascending."""
        return list(self._by_index.get(index, ()))

    def is_configured(self, *indices: int) -> bool:
        """Return whether a DCF sets a value for any writable sub-index of these objects."""
        return any(
            entry.configured and entry.access.writable
            for index in indices
            for entry in self.subindices(index)
        )

    def for_node(self, node_id: int) -> ObjectDictionary:
        """Return a copy whose node-relative defaults are resolved for a node id.

        A COB-ID of the pre-defined connection set is converted to this node id, even if the file
        gives it for another node id or for none.
        """
        return ObjectDictionary(
            (self._resolved(entry, node_id) for entry in self), source=self.source, node_id=node_id
        )

    def _resolved(self, entry: ObjectEntry, node_id: int) -> ObjectEntry:
        if entry.node_relative:
            offset = entry.default if isinstance(entry.default, int) else 0
            return replace(entry, default=offset + node_id, node_relative=False)
        if not isinstance(entry.default, int):
            return entry
        cob_id = own_cob_id(entry.address, entry.default, node_id, self.node_id)
        if cob_id == entry.default:
            return entry
        return replace(entry, default=cob_id, literal=entry.default)


PROFILE_MASK = 0xFFFF  # bits of 0x1000 that hold the number of the profile (CiA 301, 7.5.2.1)


class DeviceProfile(IntEnum):
    """Numbers of the supported device profiles."""

    GENERIC_IO = 401
    DRIVE = 402
    ENCODER = 406


def profile_number(dictionary: ObjectDictionary) -> int:
    """Return the profile number of the EDS; 0 if it names none."""
    return (dictionary.number(Index.DEVICE_TYPE) or 0) & PROFILE_MASK


def is_drive(dictionary: ObjectDictionary) -> bool:
    """Return whether 0x6040 etc. are objects of CiA 402; other profiles reuse the indices."""
    number = profile_number(dictionary)
    if number:
        return number == DeviceProfile.DRIVE
    return bool(drive_axes(dictionary))


def drive_axes(dictionary: ObjectDictionary) -> tuple[int, ...]:
    """Return the numbers, from 0, of the axes with a controlword and a statusword."""
    words = (Index.CONTROLWORD, Index.STATUSWORD)
    return tuple(
        axis
        for axis in range(AXES_MAX)
        if all(dictionary.has_index(word + AXIS_OFFSET * axis) for word in words)
    )


NUMBER = re.compile(r'(?:0x)?([0-9a-f]{4})(?::(?:0x)?([0-9a-f]{1,2}))?', re.IGNORECASE)
SIMILAR_MAX = 4


def find_object(dictionary: ObjectDictionary, path: str) -> ObjectEntry:
    """Find an object by number or name; the module docstring describes the syntax.

    Raises:
        ObjectError: No object or several match; the message names the candidates.
    """
    number = NUMBER.fullmatch(path.strip())
    if number is not None:
        return _by_number(dictionary, int(number[1], 16), int(number[2] or '0', 16))
    return _by_name(dictionary, path)


def object_path(entry: ObjectEntry) -> str:
    """Return the name by which :func:`find_object` finds an object."""
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
    """Whether each part of a name begins with the wanted part; a single part matches any."""
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
