# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with an EDS or DCF file, by CiA 306-1 and by the objects that it describes.

Reading is tolerant, as vendors' files are what they are. Here is reported what other tools stumble
over, and what misleads a master: an object that cannot be mapped although it has to be.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
import os
from pathlib import Path
from typing import TypeAlias

from arm_canopen.config import Direction, eds_mapping, RPDO, TPDO
from canopen_core import ConfigError, Findings, Place, Problem
from canopen_core.eds import (
    DUMMY_TYPES,
    Eds,
    IniFile,
    IniSection,
    load_eds,
    parse_integer,
    read_eds_text,
    read_ini,
)
from canopen_core.standard import (
    AccessType,
    bit_length,
    COB_ID_INVALID,
    DataType,
    DeviceProfile,
    Index,
    is_drive,
    object_address,
    ObjectDictionary,
    ObjectEntry,
    PDO_COUNT_MAX,
    pdo_object,
    PREDEFINED_MAX,
    profile_number,
)


class Role(Enum):
    """Who has to be able to do what; the value says it."""

    VALUE = 'read-only: the device sets it'
    SETTING = 'written by the master'
    EITHER = 'readable'


READABLE_ONLY = frozenset({AccessType.READ_ONLY, AccessType.CONSTANT})
ACCESS: dict[Role, frozenset[AccessType]] = {
    Role.VALUE: READABLE_ONLY,
    Role.SETTING: frozenset(AccessType) - READABLE_ONLY,
    Role.EITHER: frozenset(AccessType) - {AccessType.WRITE_ONLY},
}


U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
I8, I16, I32 = DataType.INTEGER8, DataType.INTEGER16, DataType.INTEGER32

Rows: TypeAlias = tuple[tuple[int, int, DataType, Role], ...]

_COMMUNICATION: Rows = (  # CiA 301, 7.5.2
    (Index.DEVICE_TYPE, 0, U32, Role.VALUE),
    (Index.ERROR_REGISTER, 0, U8, Role.VALUE),
    (Index.SYNC_COB_ID, 0, U32, Role.EITHER),
    (Index.CYCLE_PERIOD, 0, U32, Role.SETTING),
    (Index.SYNC_WINDOW, 0, U32, Role.SETTING),
    (Index.DEVICE_NAME, 0, DataType.VISIBLE_STRING, Role.VALUE),
    (Index.HARDWARE_VERSION, 0, DataType.VISIBLE_STRING, Role.VALUE),
    (Index.SOFTWARE_VERSION, 0, DataType.VISIBLE_STRING, Role.VALUE),
    (Index.GUARD_TIME, 0, U16, Role.EITHER),
    (Index.LIFE_TIME_FACTOR, 0, U8, Role.EITHER),
    (Index.TIME_COB_ID, 0, U32, Role.EITHER),
    (Index.EMCY_COB_ID, 0, U32, Role.EITHER),
    (Index.EMCY_INHIBIT_TIME, 0, U16, Role.SETTING),
    (Index.CONSUMER_HEARTBEAT, 1, U32, Role.SETTING),
    (Index.PRODUCER_HEARTBEAT, 0, U16, Role.EITHER),
    (Index.IDENTITY, 1, U32, Role.VALUE),
    (Index.IDENTITY, 2, U32, Role.VALUE),
    (Index.IDENTITY, 3, U32, Role.VALUE),
    (Index.IDENTITY, 4, U32, Role.VALUE),
    (Index.SYNC_OVERFLOW, 0, U8, Role.SETTING),
)
_DRIVE: Rows = (  # CiA 402-2, clause 7 and the clauses of the modes
    (Index.ERROR_CODE, 0, U16, Role.VALUE),
    (Index.CONTROLWORD, 0, U16, Role.SETTING),
    (Index.STATUSWORD, 0, U16, Role.VALUE),
    (Index.QUICK_STOP_OPTION, 0, I16, Role.EITHER),
    (Index.MODE_OF_OPERATION, 0, I8, Role.SETTING),
    (Index.MODE_OF_OPERATION_DISPLAY, 0, I8, Role.VALUE),
    (Index.POSITION_DEMAND, 0, I32, Role.VALUE),
    (Index.POSITION_ACTUAL, 0, I32, Role.VALUE),
    (Index.VELOCITY_ACTUAL, 0, I32, Role.VALUE),
    (Index.TARGET_TORQUE, 0, I16, Role.SETTING),
    (Index.TORQUE_ACTUAL, 0, I16, Role.VALUE),
    (Index.TARGET_POSITION, 0, I32, Role.SETTING),
    (Index.PROFILE_VELOCITY, 0, U32, Role.SETTING),
    (Index.PROFILE_ACCELERATION, 0, U32, Role.SETTING),
    (Index.PROFILE_DECELERATION, 0, U32, Role.SETTING),
    (Index.QUICK_STOP_DECELERATION, 0, U32, Role.SETTING),
    (Index.HOMING_METHOD, 0, I8, Role.SETTING),
    (Index.INTERPOLATION_PERIOD, 1, U8, Role.EITHER),
    (Index.INTERPOLATION_PERIOD, 2, I8, Role.EITHER),
    (Index.TARGET_VELOCITY, 0, I32, Role.SETTING),
    (Index.SUPPORTED_MODES, 0, U32, Role.VALUE),
)

_GENERIC_IO: Rows = (  # CiA 401, clause 7: the first of each kind
    (0x6000, 1, U8, Role.VALUE),
    (0x6200, 1, U8, Role.SETTING),
    (0x6401, 1, I16, Role.VALUE),
    (0x6411, 1, I16, Role.SETTING),
)
_ENCODER: Rows = (  # CiA 406, clause 7
    (0x6000, 0, U16, Role.EITHER),
    (0x6001, 0, U32, Role.EITHER),
    (0x6002, 0, U32, Role.EITHER),
    (0x6003, 0, U32, Role.SETTING),
    (0x6004, 0, U32, Role.VALUE),
)
_PROFILES: dict[int, Rows] = {
    DeviceProfile.GENERIC_IO: _GENERIC_IO,
    DeviceProfile.DRIVE: _DRIVE,
    DeviceProfile.ENCODER: _ENCODER,
}


def standard_objects(dictionary: ObjectDictionary) -> dict[tuple[int, int], tuple[DataType, Role]]:
    """Return what CiA 301 and the profile of a device define, by index and sub-index."""
    number = DeviceProfile.DRIVE if is_drive(dictionary) else profile_number(dictionary)
    return {
        (index, subindex): (data_type, role)
        for index, subindex, data_type, role in (*_COMMUNICATION, *_PROFILES.get(number, ()))
    }


MANDATORY: dict[tuple[int, int], str] = {
    (Index.DEVICE_TYPE, 0): 'device type',
    (Index.ERROR_REGISTER, 0): 'error register',
    (Index.IDENTITY, 1): 'vendor id',
}
"""What every CANopen device has (CiA 301, 7.5.2)."""


RPDO_TARGETS = (Index.CONTROLWORD, Index.TARGET_POSITION, Index.TARGET_VELOCITY)
TPDO_VALUES = (Index.STATUSWORD, Index.POSITION_ACTUAL)
DIRECTED = (AccessType.READ_WRITE_TPDO, AccessType.READ_WRITE_RPDO)


@dataclass(frozen=True, slots=True)
class EdsReport:
    """What was found in an EDS or DCF."""

    eds: Eds | None  # its content, None when the file could not be read
    # what contradicts the standard, and may make other tools refuse the file
    errors: tuple[Problem, ...]
    # what is odd; beginning with what the tolerant reading passed over
    warnings: tuple[Problem, ...]


def lint_eds(path: str | os.PathLike[str]) -> EdsReport:
    """Find everything that is wrong with an EDS or DCF file."""
    path = Path(path)
    findings = Findings()
    try:
        eds = load_eds(path)
        ini = read_ini(read_eds_text(path, findings))
    except ConfigError as error:
        return EdsReport(None, error.problems, ())
    findings.extend(warnings=eds.warnings)
    check_info(path, ini, eds.dictionary, findings)
    check_lists(path, ini, findings)
    _Linter(eds, ini, findings).check()
    check_pdo_objects(eds, findings)
    warnings = sorted(findings.warnings, key=lambda problem: problem.line)
    return EdsReport(eds, findings.errors, tuple(warnings))


class _Linter:
    """Looks at each object."""

    def __init__(self, eds: Eds, ini: IniFile, findings: Findings) -> None:
        self._path = eds.path
        self._dictionary: ObjectDictionary = eds.dictionary
        self._sections = ini.sections
        self._standard = standard_objects(eds.dictionary)
        self._is_drive = is_drive(eds.dictionary)
        self._findings = findings

    def check(self) -> None:
        """Check everything."""
        for address, title in MANDATORY.items():
            if address not in self._dictionary:
                self._findings.error(
                    Place(self._path),
                    f'{object_address(*address)} ({title}) is missing; every device has it',
                    'add it, or request from the vendor a complete file',
                )
        indices = dict.fromkeys(entry.index for entry in self._dictionary)
        for index in indices:
            self._check_count(index)
        for entry in self._dictionary:
            if not entry.name:
                what = 'the object has no ParameterName'
                self._add(entry, 'parametername', what, 'give it one')
            self._check_standard(entry)
            self._check_limits(entry)
            self._check_mappable(entry)

    def _check_count(self, index: int) -> None:
        """Sub-index 0 of an array or record is its highest sub-index (CiA 301, 7.4.3)."""
        entries = self._dictionary.subindices(index)
        highest = entries[-1].subindex
        if highest == 0:
            return
        first = entries[0]
        if first.subindex != 0:
            what = f'{object_address(index)} has no sub-index 0'
            self._add(first, '', what, 'add it', error=True)
            return
        count, pdo = first.default, pdo_object(index)
        counts_use = index == Index.PREDEFINED_ERROR_FIELD or (pdo is not None and pdo.is_mapping)
        if not isinstance(count, int) or counts_use:
            return
        if count != highest:
            self._add(
                first,
                'defaultvalue',
                f'sub-index 0 is {count}, but the highest sub-index is {highest}',
                f'write DefaultValue={highest}',
            )

    def _check_standard(self, entry: ObjectEntry) -> None:
        """Compare with what CiA 301 and the profile of the device define for the object."""
        standard = self._standard.get(entry.address)
        if standard is None:
            return
        data_type, role = standard
        if entry.data_type is not data_type:
            self._add(
                entry,
                'datatype',
                f'the data type is {entry.data_type.name}, by the standard it is {data_type.name}',
                f'write DataType=0x{data_type:04X}, if the device keeps to the standard',
                error=True,
            )
        if entry.access not in ACCESS[role]:
            self._add(
                entry,
                'accesstype',
                f'AccessType is {entry.access.value}, but the object is {role.value}',
                'correct AccessType, on which the master relies',
            )

    def _check_limits(self, entry: ObjectEntry) -> None:
        value, low, high = entry.default, entry.low_limit, entry.high_limit
        if isinstance(value, bool) or not isinstance(value, (int, float)) or entry.node_relative:
            return
        if (low is not None and value < low) or (high is not None and value > high):
            self._add(
                entry,
                'defaultvalue',
                f'the default {value} is beyond its limits ({_limits(low, high)})',
                'correct DefaultValue, LowLimit or HighLimit',
                error=True,
            )

    def _check_mappable(self, entry: ObjectEntry) -> None:
        if entry.pdo_mappable and bit_length(entry.data_type) is None:
            self._add(
                entry,
                'pdomapping',
                f'PDOMapping is 1, but {entry.data_type.name} has no fixed length',
                'write PDOMapping=0',
                error=True,
            )
        if entry.pdo_mappable and entry.access is AccessType.CONSTANT and entry.subindex:
            self._add(
                entry, 'pdomapping', 'PDOMapping is 1, but it is constant', 'write PDOMapping=0'
            )
        if not entry.pdo_mappable and entry.access in DIRECTED:
            self._add(
                entry,
                'pdomapping',
                f'AccessType {entry.access.value} names a direction of PDOs, but PDOMapping is 0',
                'write PDOMapping=1, or AccessType=rw',
            )
        for indices, title, mappable in (
            (RPDO_TARGETS, 'RPDO', entry.rpdo_mappable),
            (TPDO_VALUES, 'TPDO', entry.tpdo_mappable),
        ):
            if self._is_drive and entry.index in indices and not mappable:
                self._add(
                    entry,
                    'pdomapping',
                    f'it cannot be mapped into a {title} (PDOMapping {int(entry.pdo_mappable)}, '
                    f'AccessType {entry.access.value}): the drive cannot be run in the cycle',
                    'correct PDOMapping and AccessType if the manual allows it',
                )

    def _add(
        self, entry: ObjectEntry, key: str, message: str, remedy: str, *, error: bool = False
    ) -> None:
        """Report something at a key of an object."""
        name = f'{entry.index:x}sub{entry.subindex:x}'
        section = self._sections.get(name) or self._sections.get(f'{entry.index:x}')
        line = section.line_of(key) if section is not None else entry.line
        title = section.title if section is not None else f'{entry.index:04X}'
        add = self._findings.error if error else self._findings.warning
        named = f'{entry.name}: {message}' if entry.name else message
        add(Place(self._path, line, f'[{title}]'), named, remedy)


def _limits(low: float | None, high: float | None) -> str:
    if low is None or high is None:
        return f'at least {low}' if high is None else f'at most {high}'
    return f'{low} to {high}'


MANDATORY_INDICES = (Index.DEVICE_TYPE, Index.ERROR_REGISTER, Index.IDENTITY)
MANUFACTURER = range(0x2000, 0x6000)  # CiA 301, table 40
LISTS = {
    'mandatoryobjects': 'MandatoryObjects',
    'optionalobjects': 'OptionalObjects',
    'manufacturerobjects': 'ManufacturerObjects',
}
PDO_COUNTS: tuple[tuple[str, str, Direction], ...] = (
    ('nrofrxpdo', 'NrOfRXPDO', RPDO),
    ('nroftxpdo', 'NrOfTXPDO', TPDO),
)


def check_info(path: Path, ini: IniFile, dictionary: ObjectDictionary, findings: Findings) -> None:
    """Check the numbers of PDOs in the section DeviceInfo."""
    info = ini.sections.get('deviceinfo')
    if info is None:
        return
    for key, title, direction in PDO_COUNTS:
        count, number = _number(info, key), len(direction.numbers(dictionary))
        if count is not None and count != number:
            findings.warning(
                Place(path, info.line_of(key), key='[DeviceInfo]'),
                f'{title} is {count}, but there are {number} {direction.title}s',
                f'write {title}={number}',
            )


def check_lists(path: Path, ini: IniFile, findings: Findings) -> None:
    """Check that each object is in the list that it belongs to, and in one only."""
    seen: dict[int, str] = {}
    for name, title in LISTS.items():
        section = ini.sections.get(name)
        if section is None:
            if name == 'mandatoryobjects':
                findings.warning(Place(path), f'no section [{title}]', 'add it')
            continue
        for key, value in section.values.items():
            if key == 'supportedobjects':
                continue
            index = _number(section, key)
            if index is None:
                continue
            place = Place(path, value.line, f'[{title}]')
            if index in seen:
                findings.warning(
                    place,
                    f'{object_address(index)} is listed a second time, first in [{seen[index]}]',
                    'remove it',
                )
            elif proper_list(index) != title:
                findings.warning(
                    place,
                    f'{object_address(index)} does not belong here',
                    f'move it to [{proper_list(index)}]',
                )
            seen.setdefault(index, title)


def proper_list(index: int) -> str:
    """Return the title of the list that an object belongs to."""
    if index in MANDATORY_INDICES:
        return LISTS['mandatoryobjects']
    return LISTS['manufacturerobjects' if index in MANUFACTURER else 'optionalobjects']


def _number(section: IniSection, key: str) -> int | None:
    """Return a number, None when there is none or reading has complained already."""
    try:
        return parse_integer(section.text(key))
    except ValueError:
        return None


def check_pdo_objects(eds: Eds, findings: Findings) -> None:
    """Check communication and mapping parameters of every PDO."""
    for direction in (RPDO, TPDO):
        for number in direction.numbers(eds.dictionary):
            _check_identifier(eds, direction, number, findings)
            _check_mapping(eds, direction, number, findings)
        for mapping in sorted({entry.index for entry in eds.dictionary}):
            number = mapping - direction.mapping + 1
            index = direction.communication + number - 1
            if not 0 < number <= PDO_COUNT_MAX:
                continue
            if not eds.dictionary.has_index(index):
                findings.error(
                    Place(eds.path, key=f'[{index:04X}]'),
                    f'{direction.title} {number} has a mapping ({object_address(mapping)}), but '
                    f'no communication parameter {object_address(index)}',
                    'add it',
                )


def _check_identifier(eds: Eds, direction: Direction, number: int, findings: Findings) -> None:
    """Devices of one kind need identifiers of their own, so the default adds the node id."""
    entry = eds.dictionary.get(direction.communication + number - 1, 1)
    if entry is None:
        findings.error(
            Place(eds.path, key=f'[{direction.communication + number - 1:04X}]'),
            f'{direction.title} {number} has no sub-index 1 (COB-ID)',
            'add it',
        )
        return
    default = entry.default
    if not isinstance(default, int) or default & COB_ID_INVALID or entry.node_relative:
        return
    if eds.node_id is None and number <= PREDEFINED_MAX:
        findings.warning(
            _place(eds, entry),
            f'the COB-ID of {direction.title} {number} does not depend on the node id '
            f'(0x{default:X}): two such devices on a bus would have the same',
            f'write DefaultValue=$NODEID+0x{direction.default_cob_id(number, 0):X}',
        )


def _check_mapping(eds: Eds, direction: Direction, number: int, findings: Findings) -> None:
    index = direction.mapping + number - 1
    entries = eds.dictionary.subindices(index)
    if not entries:
        findings.error(
            Place(eds.path, key=f'[{index:04X}]'),
            f'{direction.title} {number} has no mapping: {object_address(index)} is missing',
            'add it',
        )
        return
    count = entries[0].default
    if entries[0].subindex == 0 and isinstance(count, int) and count > len(entries) - 1:
        findings.error(
            _place(eds, entries[0]),
            f'{direction.title} {number} maps {count} objects, but has {len(entries) - 1} entries',
            f'write DefaultValue={len(entries) - 1}, or add entries',
        )
    for mapped in eds_mapping(direction, number, eds, findings):
        entry = eds.dictionary.get(mapped.index, mapped.subindex)
        if entry is None or mapped.index in DUMMY_TYPES or direction.mappable(entry):
            continue
        findings.warning(
            _place(eds, entries[0]),
            f'{direction.title} {number} maps {entry} by default, which cannot be mapped there '
            f'(PDOMapping {int(entry.pdo_mappable)}, AccessType {entry.access.value})',
            'correct PDOMapping and AccessType of the object',
        )


def _place(eds: Eds, entry: ObjectEntry) -> Place:
    return Place(eds.path, entry.line, f'[{entry.index:04X}sub{entry.subindex:X}]')
