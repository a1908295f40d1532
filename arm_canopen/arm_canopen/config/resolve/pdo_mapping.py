# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""PDO mappings: of the EDS, and of bus.yml (CiA 301, 7.5.2.36 and 7.5.2.38)."""

from __future__ import annotations

from canopen_core import Findings, Place, RefusedError
from canopen_core.eds import DUMMY_TYPES, Eds
from canopen_core.standard import (
    bit_length,
    DataType,
    is_drive,
    is_signed,
    MAPPED_LENGTH_MASK,
    mapped_place,
    MappedObject,
    object_address,
    ObjectDictionary,
    ObjectEntry,
    PDO_BITS_MAX,
    SIGNED_BITS,
    UNSIGNED_BITS,
)

from ..model.pdo import Direction, RPDO
from ..read.document import Item, YamlList
from ..sections import MAPPING_KEYS
from .sdo_list import find_entry, read_object

SIGNED_BY_BITS = {bits: data_type for data_type, bits in SIGNED_BITS.items()}
UNSIGNED_BY_BITS = {1: DataType.BOOLEAN} | {bits: kind for kind, bits in UNSIGNED_BITS.items()}
"""How bits are read whose object the EDS does not describe."""

EDS_REMEDY = 'name its mapping in bus.yml, or correct the EDS'


def mapping_slots(direction: Direction, number: int, dictionary: ObjectDictionary) -> int:
    """Return how many objects the EDS lets a PDO map."""
    return sum(
        1 for entry in dictionary.subindices(direction.mapping + number - 1) if entry.subindex
    )


def is_fixed(direction: Direction, number: int, dictionary: ObjectDictionary) -> bool:
    """Return whether the mapping cannot be written."""
    entry = dictionary.get(direction.mapping + number - 1, 0)
    return entry is None or not entry.access.writable


def eds_mapping(
    direction: Direction, number: int, eds: Eds, findings: Findings
) -> tuple[MappedObject, ...]:
    """Return the mapping that a PDO has by the EDS; empty when it cannot be understood.

    Objects that the EDS does not have, or not of this length, are reported as warnings.
    """
    entries = eds.dictionary.subindices(direction.mapping + number - 1)
    count = entries[0].default if entries and entries[0].subindex == 0 else 0
    used = entries[1 : 1 + count] if isinstance(count, int) else []
    mapping: list[MappedObject] = []
    for entry in used:
        if not isinstance(entry.default, int) or entry.default == 0:
            continue
        place = Place(eds.path, entry.line, f'[{entry.index:04X}sub{entry.subindex:X}]')
        mapped = _from_word(entry.default, eds.dictionary, place, findings)
        if mapped is None:
            return ()
        mapping.append(mapped)
    flagged = [
        entry.default
        for entry in used
        if isinstance(entry.default, int) and entry.default & 0xFF & ~MAPPED_LENGTH_MASK
    ]
    if flagged:
        findings.warning(
            Place(eds.path, entries[0].line, f'[{entries[0].index:04X}]'),
            f'bit 7 of the length is set in 0x{flagged[0]:08X}; it is ignored, also in others',
            EDS_REMEDY,
        )
    if sum(mapped.bits for mapped in mapping) > PDO_BITS_MAX:
        place = Place(eds.path, entries[0].line, f'[{entries[0].index:04X}]')
        findings.warning(place, 'the default mapping is longer than 64 bits', EDS_REMEDY)
        return ()
    return tuple(mapping)


def _from_word(
    word: int, dictionary: ObjectDictionary, place: Place, findings: Findings
) -> MappedObject | None:
    index, subindex, bits = mapped_place(word)
    if index in DUMMY_TYPES and subindex == 0:
        return MappedObject(index, subindex, DataType(index))
    entry = dictionary.get(index, subindex)
    if entry is not None and bit_length(entry.data_type) == bits:
        return MappedObject(index, subindex, entry.data_type)
    name = object_address(index, subindex)
    what = f'{name}, which is not there' if entry is None else f'{entry} with {bits} bits'
    # an object of a drive whose sign the standard knows is not read without it
    signed = is_signed(index, subindex) and is_drive(dictionary)
    data_type = (SIGNED_BY_BITS if signed else UNSIGNED_BY_BITS).get(bits)
    result = 'the PDO is ignored' if data_type is None else f'taken as {data_type.name}'
    findings.warning(place, f'maps {what}; {result}', EDS_REMEDY)
    return None if data_type is None else MappedObject(index, subindex, data_type)


def read_mapping(
    direction: Direction, number: int, entries: YamlList, eds: Eds, findings: Findings
) -> tuple[MappedObject, ...]:
    """Read the list ``mapping`` that bus.yml gives a PDO; report what cannot be mapped."""
    objects = (_mapped_object(direction, item, eds, findings) for item in entries.items)
    mapping = tuple(mapped for mapped in objects if mapped is not None)
    bits = sum(mapped.bits for mapped in mapping)
    slots = mapping_slots(direction, number, eds.dictionary)
    if bits > PDO_BITS_MAX:
        findings.error(
            entries.place,
            f'the mapped objects have {bits} bits together, a PDO carries at most {PDO_BITS_MAX}',
            'move objects to another PDO',
        )
    elif len(mapping) > slots:
        findings.error(
            entries.place,
            f'{len(mapping)} objects are mapped, {direction.title} {number} of this device takes '
            f'at most {slots}',
            'move objects to another PDO',
        )
    return mapping


def _mapped_object(
    direction: Direction, item: Item, eds: Eds, findings: Findings
) -> MappedObject | None:
    values = read_object(item, MAPPING_KEYS, findings)
    if values is None:
        return None
    index, subindex = values['index'], values['subindex']
    try:
        if index in DUMMY_TYPES and subindex == 0:
            return _dummy(direction, index, eds)
        entry = find_entry(eds.dictionary, index, subindex)
        _check_mappable(direction, entry)
    except RefusedError as reason:
        findings.refuse(item.place, reason)
        return None
    return MappedObject(index, subindex, entry.data_type)


def _dummy(direction: Direction, index: int, eds: Eds) -> MappedObject:
    """Map a gap: a data type in place of an object (CiA 301, 7.4.7.1)."""
    name = DataType(index).name
    if direction is not RPDO:
        raise RefusedError(
            f'the gap {object_address(index)} ({name}) is for RPDOs only', 'remove the entry'
        )
    if index not in eds.dummy_types:
        raise RefusedError(
            f'the device does not take the gap {object_address(index)} ({name}; DummyUsage in '
            'its EDS)',
            'take another type',
        )
    return MappedObject(index, 0, DataType(index))


def _check_mappable(direction: Direction, entry: ObjectEntry) -> None:
    if bit_length(entry.data_type) is None:
        raise RefusedError(
            f'{entry} has no fixed length ({entry.data_type.name})', 'read and write it by SDO'
        )
    if direction.mappable(entry):
        return
    flag = 'yes' if entry.pdo_mappable else 'no'
    raise RefusedError(
        f'{entry} cannot be mapped into a {direction.title} (EDS: PDO mapping {flag}, '
        f'access {entry.access.value})',
        'map another object, or correct PDOMapping in the EDS if the manual allows it',
    )
