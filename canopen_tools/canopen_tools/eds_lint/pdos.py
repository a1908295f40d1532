# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks of the PDOs that an EDS describes (CiA 301, 7.5.2.35 to 7.5.2.38)."""

from __future__ import annotations

from arm_canopen.config import Eds
from arm_canopen.config.findings import Findings, Place
from arm_canopen.config.model.pdo_direction import Direction, RPDO, TPDO
from arm_canopen.config.read.eds import DUMMY_TYPES
from arm_canopen.config.resolve.pdo_mapping import eds_mapping
from arm_canopen.standard import COB_ID_INVALID, object_address, ObjectEntry, PREDEFINED_MAX


def check_pdo_objects(eds: Eds, findings: Findings) -> None:
    """Check communication and mapping parameters of every PDO."""
    for direction in (RPDO, TPDO):
        for number in direction.numbers(eds.dictionary):
            _check_identifier(eds, direction, number, findings)
            _check_mapping(eds, direction, number, findings)
        for number in _mapping_numbers(eds, direction):
            index, mapping = direction.communication + number - 1, direction.mapping + number - 1
            if not eds.dictionary.has_index(index):
                findings.error(
                    Place(eds.path, key=f'[{index:04X}]'),
                    f'{direction.title} {number} has a mapping ({object_address(mapping)}), but '
                    f'no communication parameter {object_address(index)}',
                    'add it',
                )


def _mapping_numbers(eds: Eds, direction: Direction) -> list[int]:
    first = direction.mapping
    indices = {entry.index for entry in eds.dictionary}
    return sorted(index - first + 1 for index in indices if first <= index < first + 0x200)


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
