# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Check an EDS or DCF file for errors that mislead a master, by CiA 301, CiA 402 and itself.

The parser tolerates faults of vendors' files; this check reports them, too.
"""

from __future__ import annotations

from dataclasses import dataclass
import os
from pathlib import Path

from arm_canopen.config import DEFAULT_DRIVE, Direction, eds_mapping, RPDO, TPDO
from canopen_core import ConfigError, Findings, Place, Problem
from canopen_core.eds import DUMMY_TYPES, Eds, load_eds
from canopen_core.standard import (
    AccessType,
    COB_ID_INVALID,
    Index,
    is_drive,
    object_address,
    ObjectEntry,
    PDO_COUNT_MAX,
    pdo_object,
    PREDEFINED_MAX,
)

MANDATORY: dict[tuple[int, int], str] = {
    (Index.DEVICE_TYPE, 0): 'device type',
    (Index.ERROR_REGISTER, 0): 'error register',
    (Index.IDENTITY, 1): 'vendor id',
}
"""Objects of every CANopen device (CiA 301, 7.5.2)."""
PROFILE_BEGIN = 0x2000  # lower indices mean the same for all devices (CiA 301, table 40)
IN_CYCLE: dict[int, Direction] = {
    Index.CONTROLWORD: RPDO,
    Index.TARGET_POSITION: RPDO,
    Index.TARGET_VELOCITY: RPDO,
    Index.STATUSWORD: TPDO,
    Index.POSITION_ACTUAL: TPDO,
}
"""Objects that a master exchanges with a drive in each cycle."""


@dataclass(frozen=True, slots=True)
class EdsReport:
    """Result of checking an EDS or DCF."""

    eds: Eds | None  # its content; None if unreadable
    # violations of the standard, for which other tools may reject the file
    errors: tuple[Problem, ...]
    # oddities, starting with those that the parser tolerated
    warnings: tuple[Problem, ...]


def lint_eds(path: str | os.PathLike[str]) -> EdsReport:
    """Check an EDS or DCF file completely."""
    path = Path(path)
    try:
        eds = load_eds(path)
    except ConfigError as error:
        return EdsReport(None, error.problems, ())
    findings = Findings()
    findings.extend(warnings=eds.warnings)
    _check_objects(eds, findings)
    for direction in (RPDO, TPDO):
        _check_pdos(eds, direction, findings)
    warnings = sorted(findings.warnings, key=lambda problem: problem.line)
    return EdsReport(eds, findings.errors, tuple(warnings))


def _check_objects(eds: Eds, findings: Findings) -> None:
    for address, title in MANDATORY.items():
        if address not in eds.dictionary:
            findings.error(
                Place(eds.path),
                f'{object_address(*address)} ({title}) is missing; every device has it',
                'add it, or request from the vendor a complete file',
            )
    drive = is_drive(eds.dictionary)
    standard = load_eds(DEFAULT_DRIVE).dictionary
    for entry in eds.dictionary:
        known = standard.get(*entry.address)
        if known is not None and (drive or entry.index < PROFILE_BEGIN):
            _check_standard(eds, entry, known, findings)
        way = IN_CYCLE.get(entry.index)
        if drive and way is not None and not way.mappable(entry):
            findings.warning(
                _place(eds, entry),
                f'{entry.name}: it cannot be mapped into a {way.title} (PDOMapping '
                f'{int(entry.pdo_mappable)}, AccessType {entry.access.value}): the drive cannot '
                'be run in the cycle',
                'correct PDOMapping and AccessType if the manual allows it',
            )


def _check_standard(eds: Eds, entry: ObjectEntry, known: ObjectEntry, findings: Findings) -> None:
    """Compare an object with the standard, except PDO objects; see :func:`_check_pdos`."""
    if pdo_object(entry.index) is not None:
        return
    if entry.data_type is not known.data_type:
        findings.error(
            _place(eds, entry),
            f'{entry.name}: the data type is {entry.data_type.name}, by the standard it is '
            f'{known.data_type.name}',
            f'write DataType=0x{known.data_type:04X}, if the device keeps to the standard',
        )
    role = ''
    if known.access is AccessType.READ_ONLY and entry.access.writable:
        role = 'read-only: the device sets it'
    elif known.rpdo_mappable and not entry.access.writable:
        role = 'written by the master'
    if role:
        findings.warning(
            _place(eds, entry),
            f'{entry.name}: AccessType is {entry.access.value}, but the object is {role}',
            'correct AccessType, on which the master relies',
        )


def _check_pdos(eds: Eds, direction: Direction, findings: Findings) -> None:
    """Check communication and mapping parameters of every PDO of a direction."""
    numbers = direction.numbers(eds.dictionary)
    for number in numbers:
        _check_identifier(eds, direction, number, findings)
        _check_mapping(eds, direction, number, findings)
    first = direction.mapping
    for mapping in sorted({entry.index for entry in eds.dictionary}):
        number = mapping - first + 1
        if first <= mapping < first + PDO_COUNT_MAX and number not in numbers:
            index = direction.communication + number - 1
            findings.error(
                Place(eds.path, key=f'[{index:04X}]'),
                f'{direction.title} {number} has a mapping ({object_address(mapping)}), but '
                f'no communication parameter {object_address(index)}',
                'add it',
            )


def _check_identifier(eds: Eds, direction: Direction, number: int, findings: Findings) -> None:
    """Check that the default COB-ID includes the node id, so that equal devices differ."""
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
    part = f'sub{entry.subindex:X}' if entry.record else ''
    return Place(eds.path, entry.line, f'[{entry.index:04X}{part}]')
