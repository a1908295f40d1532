# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads EDS and DCF files (CiA 306-1), tolerant of errors in vendors' files.

The sections of a file become the entries of an object dictionary (CiA 306-1, 4.6).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
import os
from pathlib import Path
import re
from typing import TypeVar

from ..exceptions import ConfigError, Problem
from ..standard.datatypes import DataType, integer_range, REAL_FORMATS, Value
from ..standard.dictionary import (
    AccessType,
    object_address,
    ObjectCode,
    ObjectDictionary,
    ObjectEntry,
)
from ..standard.messages import COB_ID_INVALID, CobId, NODE_ID_MAX, NODE_ID_MIN, PREDEFINED_MAX
from ..standard.objects import Index, PDO_COUNT_MAX
from .ini import decode_text, EdsValue, IniFile, IniSection, parse_integer, parse_value, read_ini

SIZE_MAX = 16 * 1024 * 1024  # [byte] larger files are no EDS
DUMMY_TYPES = range(0x0002, 0x0008)  # INTEGER8 to UNSIGNED32 (CiA 301, 7.4.7.1)
COMMISSIONING = ('devicecomissioning', 'devicecommissioning')  # the standard misspells it
TOLERATED = 'the file is read all the same; correct it when a value is missing'


@dataclass(frozen=True, slots=True)
class Eds:
    """The content of an EDS or DCF."""

    path: Path
    dictionary: ObjectDictionary  # its objects; defaults with ``$NODEID`` are still node-relative
    node_id: int | None = None  # node id of a DCF, None in an EDS
    # data types that may stand in an RPDO as a gap
    dummy_types: frozenset[int] = frozenset(DUMMY_TYPES)
    warnings: tuple[Problem, ...] = ()  # what was odd but could be understood


def load_eds(path: str | os.PathLike[str]) -> Eds:
    """Read an EDS or DCF file; tolerated errors become warnings.

    Raises:
        ConfigError: The file is missing, unreadable or has no objects.
    """
    path = Path(path)
    ini = read_ini(_read_text(path))
    node_id = _node_id(ini)
    dictionary = ObjectDictionary(ObjectReader(ini).entries(), source=str(path), node_id=node_id)
    if not len(dictionary):
        remedy = 'name an EDS or DCF file of CiA 306'
        raise ConfigError([Problem(path, 0, '', 'no object in this file', remedy)])
    warnings = (Problem(path, line, key, text, TOLERATED) for line, key, text in ini.oddities)
    return Eds(path, dictionary, node_id, _dummy_types(ini), tuple(dict.fromkeys(warnings)))


def _read_text(path: Path) -> str:
    message, remedy = 'there is no such file', 'correct the path of the EDS'
    try:
        if path.is_file():
            if path.stat().st_size <= SIZE_MAX:
                return decode_text(path.read_bytes())
            message, remedy = 'larger than 16 MiB', 'name an EDS or DCF file'
    except (OSError, ValueError) as error:
        message, remedy = f'cannot be read: {error}', 'correct its path or permissions'
    raise ConfigError([Problem(path, 0, '', message, remedy)])


def _node_id(ini: IniFile) -> int | None:
    for section in COMMISSIONING:
        with suppress(KeyError, ValueError):
            number = parse_integer(ini.sections[section].text('nodeid'))
            if NODE_ID_MIN <= number <= NODE_ID_MAX:
                return number
    return None


def _dummy_types(ini: IniFile) -> frozenset[int]:
    """Read [DummyUsage]; a file without it allows all types, as many files omit it."""
    section = ini.sections.get('dummyusage')
    if section is None:
        return frozenset(DUMMY_TYPES)
    texts = {number: section.text(f'dummy{number:04x}') for number in DUMMY_TYPES}
    return frozenset(number for number, text in texts.items() if text not in ('', '0', '0x0'))


T = TypeVar('T')

OBJECT_SECTION = re.compile(r'([0-9a-f]{1,4})(?:sub([0-9a-f]{1,2}))?')
LISTS = ('mandatoryobjects', 'optionalobjects', 'manufacturerobjects')
COMPACT_SUBINDICES_MAX = 254
COMPACT_MAPPING = 64  # objects of a PDO that CompactPDO abbreviates, one for each bit
PDO_PARAMETERS: tuple[tuple[str, DataType], ...] = (
    ('COB-ID', DataType.UNSIGNED32),
    ('Transmission type', DataType.UNSIGNED8),
    ('Inhibit time', DataType.UNSIGNED16),
    ('Compatibility entry', DataType.UNSIGNED8),
    ('Event timer', DataType.UNSIGNED16),
    ('SYNC start value', DataType.UNSIGNED8),
)
"""Sub-indices of a communication parameter from 1 on (CiA 301, 7.5.2.35)."""
PDO_KINDS = (
    ('nrofrxpdo', Index.RPDO_COMMUNICATION, Index.RPDO_MAPPING, CobId.RPDO1),
    ('nroftxpdo', Index.TPDO_COMMUNICATION, Index.TPDO_MAPPING, CobId.TPDO1),
)
COLLECTIONS = (ObjectCode.ARRAY, ObjectCode.RECORD, ObjectCode.DEFSTRUCT)


class ObjectReader:
    """Reads all objects of one file; ``oddities`` receives skipped or guessed content."""

    def __init__(self, ini: IniFile) -> None:
        self._ini = ini
        self._objects: dict[int, IniSection] = {}
        self._parts: dict[int, dict[int, IniSection]] = {}
        for name, section in ini.sections.items():
            if match := OBJECT_SECTION.fullmatch(name):
                index = int(match[1], 16)
                if match[2] is None:
                    self._objects[index] = section
                else:
                    self._parts.setdefault(index, {})[int(match[2], 16)] = section

    def entries(self) -> Iterator[ObjectEntry]:
        """Yield all entries."""
        compact = list(self._compact_pdos())
        self._check_lists({entry.index for entry in compact})
        yield from compact
        for index, section in self._objects.items():
            yield from self._object(index, section)
        for index in self._parts.keys() - self._objects.keys():
            for subindex, part in self._parts[index].items():
                self._odd(part, '', f'sub-index without the section [{index:04X}] of its object')
                yield self._entry(index, subindex, part)

    def _object(self, index: int, section: IniSection) -> Iterator[ObjectEntry]:
        parts = self._parts.get(index, {})
        code = self._object_code(section)
        compact = self._number(section, 'compactsubobj', 0)
        if compact:
            yield from self._compact(index, section, compact)
        for subindex, part in parts.items():
            yield self._entry(index, subindex, part)
        if compact:
            return
        if code not in COLLECTIONS:
            if 0 not in parts:
                yield self._entry(index, 0, section, code)
        elif not parts:
            self._odd(section, '', f'{code.name} without sub-indices')

    def _object_code(self, section: IniSection) -> ObjectCode:
        number = self._number(section, 'objecttype', ObjectCode.VAR)
        try:
            return ObjectCode(number)
        except ValueError:
            self._odd(section, 'objecttype', f'unknown ObjectType {number}, taken as VAR')
            return ObjectCode.VAR

    def _compact(self, index: int, section: IniSection, count: int) -> Iterator[ObjectEntry]:
        """Expand an array abbreviated by CompactSubObj (CiA 306-1, 4.6.3.2)."""
        if not 0 < count <= COMPACT_SUBINDICES_MAX:
            self._odd(section, 'compactsubobj', f'CompactSubObj {count} is not 1 to 254')
            return
        line = section.line
        count_type = DataType.UNSIGNED8
        yield ObjectEntry(
            index, 0, 'NrOfObjects', count_type, AccessType.READ_ONLY, default=count, line=line
        )
        names = self._ini.sections.get(f'{index:x}name') or IniSection('', line)
        values = self._ini.sections.get(f'{index:x}value') or IniSection('', line)
        title = section.text('parametername')
        for subindex in range(1, count + 1):
            part = IniSection(section.title, line, dict(section.values))
            if own := values.values.get(str(subindex)):
                part.values['parametervalue'] = own
            name = names.text(str(subindex)) or f'{title}{subindex}'
            yield self._entry(index, subindex, part, name=name)

    def _entry(
        self,
        index: int,
        subindex: int,
        section: IniSection,
        code: ObjectCode = ObjectCode.VAR,
        *,
        name: str = '',
    ) -> ObjectEntry:
        data_type = self._data_type(section, code)
        default = self._value(section, 'defaultvalue', data_type)
        own = self._value(section, 'parametervalue', data_type)
        initial = default if own is None else own
        low, high = self._limits(section, data_type)
        whole = self._objects.get(index, section)
        return ObjectEntry(
            index,
            subindex,
            name or section.text('parametername'),
            data_type,
            self._access(section),
            default=initial.value if initial else None,
            node_relative=initial.node_relative if initial else False,
            low_limit=low,
            high_limit=high,
            pdo_mappable=bool(self._number(section, 'pdomapping', 0)),
            line=section.line,
            record=whole.text('parametername') if whole.title != section.title else '',
            configured=own is not None and own != default,
        )

    def _data_type(self, section: IniSection, code: ObjectCode) -> DataType:
        missing = DataType.DOMAIN
        number = self._number(section, 'datatype', missing if code is ObjectCode.DOMAIN else 0)
        # CANFestival's editor defines limited types of its own whose sub-index 1 is the real one
        if derived := self._parts.get(number, {}).get(1):
            number = self._number(derived, 'defaultvalue', number)
        try:
            return DataType(number)
        except ValueError:
            what = f'unknown DataType 0x{number:04X}' if number else 'no DataType'
            self._odd(section, 'datatype', f'{what}, taken as DOMAIN (bytes)')
            return missing

    def _access(self, section: IniSection) -> AccessType:
        text = section.text('accesstype').partition(';')[0].strip().lower()
        try:
            return AccessType(text)
        except ValueError:
            what = f'unknown AccessType {text[:20]!r}' if text else 'no AccessType'
            self._odd(section, 'accesstype', f'{what}, taken as rw')
            return AccessType.READ_WRITE

    def _limits(
        self, section: IniSection, data_type: DataType
    ) -> tuple[int | float | None, int | float | None]:
        if data_type not in REAL_FORMATS and integer_range(data_type) is None:
            return None, None
        low = _plain_number(self._value(section, 'lowlimit', data_type))
        high = _plain_number(self._value(section, 'highlimit', data_type))
        if low is not None and high is not None and low > high:
            self._odd(section, 'lowlimit', f'LowLimit {low} is above HighLimit {high}; ignored')
            return None, None
        return low, high

    def _value(self, section: IniSection, key: str, data_type: DataType) -> EdsValue | None:
        return self._field(section, key, partial(parse_value, data_type), None)

    def _number(self, section: IniSection, key: str, default: int) -> int:
        return self._field(section, key, parse_integer, default)

    def _field(self, section: IniSection, key: str, parse: Callable[[str], T], default: T) -> T:
        text = section.text(key)
        try:
            return parse(text) if text else default
        except ValueError as error:
            self._odd(section, key, f'{error}; ignored')
            return default

    def _compact_pdos(self) -> Iterator[ObjectEntry]:
        """Expand the PDOs abbreviated by CompactPDO (CiA 306-1, 4.5.2).

        Bit 0 stands for sub-index 1 of each communication parameter, and so on.
        """
        info = self._ini.sections.get('deviceinfo')
        mask = self._number(info, 'compactpdo', 0) if info is not None else 0
        if info is None or mask <= 0:
            return
        for key, communication, mapping, base in PDO_KINDS:
            for number in range(min(self._number(info, key, 0), PDO_COUNT_MAX)):
                if communication + number not in self._objects:
                    yield from _compact_parameters(communication + number, base, number, mask)
                if mapping + number not in self._objects:
                    yield from _compact_mapping(mapping + number)

    def _check_lists(self, compact: set[int]) -> None:
        """Report listed objects without a section, except compact ones, which need none.

        Such entries suggest that a part of the file is missing.
        """
        listed = {
            self._number(section, key, 0)
            for name in LISTS
            if (section := self._ini.sections.get(name)) is not None
            for key in section.values
            if key != 'supportedobjects'
        }
        if missing := sorted(listed - {0} - self._objects.keys() - compact):
            self._ini.odd(0, f'listed, but without a section: {_hexadecimal(missing)}')

    def _odd(self, section: IniSection, key: str, message: str) -> None:
        self._ini.odd(section.line_of(key), message, f'[{section.title}]')


def _compact_parameters(index: int, base: int, number: int, mask: int) -> Iterator[ObjectEntry]:
    """Yield a communication parameter with the sub-indices set in a mask."""
    predefined = number < PREDEFINED_MAX
    highest = min(mask.bit_length(), len(PDO_PARAMETERS))
    u8, constant = DataType.UNSIGNED8, AccessType.CONSTANT
    yield ObjectEntry(index, 0, 'Highest sub-index supported', u8, constant, default=highest)
    for position, (name, data_type) in enumerate(PDO_PARAMETERS):
        if mask >> position & 1:
            is_cob_id = position == 0
            default = base + 0x100 * number if predefined else COB_ID_INVALID
            yield ObjectEntry(
                index,
                position + 1,
                name,
                data_type,
                default=default if is_cob_id else None,
                node_relative=is_cob_id and predefined,
            )


def _compact_mapping(index: int) -> Iterator[ObjectEntry]:
    """Yield an empty mapping parameter."""
    yield ObjectEntry(index, 0, 'Number of mapped objects', DataType.UNSIGNED8, default=0)
    for subindex in range(1, COMPACT_MAPPING + 1):
        name = f'Application object {subindex}'
        yield ObjectEntry(index, subindex, name, DataType.UNSIGNED32, default=0)


def _plain_number(value: EdsValue | None) -> int | float | None:
    number: Value | None = value.value if value is not None else None
    return number if isinstance(number, (int, float)) else None


def _hexadecimal(indices: list[int]) -> str:
    shown = ', '.join(object_address(index) for index in indices[:8])
    return shown if len(indices) <= 8 else f'{shown} and {len(indices) - 8} more'
