# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with an EDS or DCF file, by CiA 306-1 and by the objects that it describes.

Reading is tolerant, as vendors' files are what they are. Here is reported what other tools stumble
over, and what misleads a master: an object that cannot be mapped although it has to be.
"""

from __future__ import annotations

from dataclasses import dataclass
import os
from pathlib import Path

from arm_canopen import ConfigError
from arm_canopen.config import Eds, load_eds, Problem
from arm_canopen.config.findings import Findings, Place
from arm_canopen.config.read.eds import read_eds_text
from arm_canopen.config.read.eds_ini import IniFile, IniSection, read_ini
from arm_canopen.standard import (
    AccessType,
    bit_length,
    Index,
    is_drive,
    object_address,
    ObjectDictionary,
    ObjectEntry,
)

from .lists import check_info, check_lists
from .pdos import check_pdo_objects
from .standard import ACCESS, MANDATORY, Role, standard_objects

COUNTED_BY_USE = (
    range(Index.PREDEFINED_ERROR_FIELD, Index.PREDEFINED_ERROR_FIELD + 1),
    range(Index.RPDO_MAPPING, Index.RPDO_MAPPING + 0x200),
    range(Index.TPDO_MAPPING, Index.TPDO_MAPPING + 0x200),
)
"""Objects whose sub-index 0 counts what is in use, not what there is."""
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
    """Look for everything that is wrong with an EDS or DCF file."""
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
        """Look at everything."""
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
            self._check_name(entry)
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
            self._add_error(first, '', f'{object_address(index)} has no sub-index 0', 'add it')
            return
        count = first.default
        if not isinstance(count, int) or any(index in indices for indices in COUNTED_BY_USE):
            return
        if count != highest:
            self._add_warning(
                first,
                'defaultvalue',
                f'sub-index 0 is {count}, but the highest sub-index is {highest}',
                f'write DefaultValue={highest}',
            )

    def _check_name(self, entry: ObjectEntry) -> None:
        if not entry.name:
            self._add_warning(
                entry, 'parametername', 'the object has no ParameterName', 'give it one'
            )

    def _check_standard(self, entry: ObjectEntry) -> None:
        """Compare with what CiA 301 and the profile of the device define for the object."""
        standard = self._standard.get(entry.address)
        if standard is None:
            return
        if entry.data_type is not standard.data_type:
            self._add_error(
                entry,
                'datatype',
                f'the data type is {entry.data_type.name}, by the standard it is '
                f'{standard.data_type.name}',
                f'write DataType=0x{standard.data_type:04X}, if the device keeps to the standard',
            )
        if entry.access not in ACCESS[standard.role]:
            wanted = {
                Role.VALUE: 'read-only: the device sets it',
                Role.SETTING: 'written by the master',
                Role.EITHER: 'readable',
            }[standard.role]
            self._add_warning(
                entry,
                'accesstype',
                f'AccessType is {entry.access.value}, but the object is {wanted}',
                'correct AccessType, on which the master relies',
            )

    def _check_limits(self, entry: ObjectEntry) -> None:
        value, low, high = entry.default, entry.low_limit, entry.high_limit
        if isinstance(value, bool) or not isinstance(value, (int, float)) or entry.node_relative:
            return
        if (low is not None and value < low) or (high is not None and value > high):
            self._add_error(
                entry,
                'defaultvalue',
                f'the default {value} is beyond its limits ({_limits(low, high)})',
                'correct DefaultValue, LowLimit or HighLimit',
            )

    def _check_mappable(self, entry: ObjectEntry) -> None:
        if entry.pdo_mappable and bit_length(entry.data_type) is None:
            self._add_error(
                entry,
                'pdomapping',
                f'PDOMapping is 1, but {entry.data_type.name} has no fixed length',
                'write PDOMapping=0',
            )
        if entry.pdo_mappable and entry.access is AccessType.CONSTANT and entry.subindex:
            self._add_warning(
                entry, 'pdomapping', 'PDOMapping is 1, but it is constant', 'write PDOMapping=0'
            )
        if not entry.pdo_mappable and entry.access in DIRECTED:
            self._add_warning(
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
                self._add_warning(
                    entry,
                    'pdomapping',
                    f'it cannot be mapped into a {title} (PDOMapping {int(entry.pdo_mappable)}, '
                    f'AccessType {entry.access.value}): the drive cannot be run in the cycle',
                    'correct PDOMapping and AccessType if the manual allows it',
                )

    def _section(self, entry: ObjectEntry) -> IniSection | None:
        name = f'{entry.index:x}sub{entry.subindex:x}'
        return self._sections.get(name) or self._sections.get(f'{entry.index:x}')

    def _place(self, entry: ObjectEntry, key: str) -> Place:
        section = self._section(entry)
        line = section.line_of(key) if section is not None else entry.line
        title = section.title if section is not None else f'{entry.index:04X}'
        return Place(self._path, line, f'[{title}]')

    def _add_warning(self, entry: ObjectEntry, key: str, message: str, remedy: str) -> None:
        self._findings.warning(self._place(entry, key), _named(entry, message), remedy)

    def _add_error(self, entry: ObjectEntry, key: str, message: str, remedy: str) -> None:
        self._findings.error(self._place(entry, key), _named(entry, message), remedy)


def _limits(low: float | None, high: float | None) -> str:
    if low is None or high is None:
        return f'at least {low}' if high is None else f'at most {high}'
    return f'{low} to {high}'


def _named(entry: ObjectEntry, message: str) -> str:
    return f'{entry.name}: {message}' if entry.name else message
