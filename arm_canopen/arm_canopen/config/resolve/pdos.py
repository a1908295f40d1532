# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The PDOs of a device with their mappings: EDS values, overridden by bus.yml.

CiA 301, 7.5.2.36 and 7.5.2.38 define the mappings.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from canopen_core import Findings, Place, RefusedError
from canopen_core.eds import DUMMY_TYPES, Eds
from canopen_core.standard import (
    bit_length,
    CAN_ID_MASK,
    COB_ID_EXTENDED,
    COB_ID_INVALID,
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
    PDO_COUNT_MAX,
    PREDEFINED_MAX,
    SIGNED_BITS,
    SYNCHRONOUS_MAX,
    UNSIGNED_BITS,
)

from ..model.bus import Direction, PdoConfig, RPDO, TPDO
from ..read.document import Item, Scalar, YamlList, YamlMap
from ..read.section import attempt, block, describe, integer, key_number, listing, read_section
from ..sections import MAPPING_KEYS, RPDO_KEYS, TPDO_KEYS
from .sdo_list import find_entry, read_object

PDO_KEYS = {TPDO.name: TPDO_KEYS, RPDO.name: RPDO_KEYS}  # the keys of one PDO
AUTO, AUTO_ID = 'auto', -1  # a free COB-ID, assigned when all others are known
TRANSMISSION_DEFAULT = 255
EVENT_TYPES = (254, 255)
SUBINDICES = {'inhibit_time': 3, 'event_time': 5, 'sync_start': 6}
"""Sub-indices of the communication parameter that not every device has (CiA 301, 7.5.2.37)."""


class PdoReader:
    """Reads the PDOs of one device."""

    def __init__(
        self, name: str, device: YamlMap, eds: Eds, node_id: int, *, findings: Findings
    ) -> None:
        """Use an EDS whose node-relative defaults are resolved."""
        self._name = name
        self._device = device
        self._eds = eds
        self._node_id = node_id
        self._findings = findings

    def read(self, direction: Direction) -> tuple[PdoConfig, ...]:
        """Return all PDOs of a direction by ascending number."""
        numbers = direction.numbers(self._eds.dictionary)
        wanted = dict(self._wanted(direction, numbers))
        pdos = []
        for number in numbers:
            pdo = self._default(direction, number)
            if number in wanted:
                pdo = self._configured(pdo, wanted[number])
            elif pdo.enabled:
                # keep the warnings of this mapping, as the PDO is in use
                eds_mapping(direction, number, self._eds, self._findings)
                self._warn_of_assumption(pdo)
            pdos.append(pdo)
        return tuple(pdos)

    def _title(self, pdo: PdoConfig) -> str:
        return f'{pdo.title} of {self._name}'

    def _warn_of_assumption(self, pdo: PdoConfig) -> None:
        """Warn of a COB-ID that the file has for another node id; the boot checks it."""
        entry = self._eds.dictionary.get(pdo.communication, 1)
        if entry is not None and entry.literal is not None and pdo.mapping:
            self._findings.warning(
                Place(self._eds.path, entry.line, f'[{entry.index:04X}sub1]'),
                f'COB-ID 0x{entry.literal & CAN_ID_MASK:03X} of {self._title(pdo)} is '
                f'not that of node {self._node_id}; it is taken to have 0x{pdo.cob_id:03X}, which '
                'is compared at boot',
                'name the PDO in bus.yml with cob_id: auto, so that it is written',
            )

    def _wanted(self, direction: Direction, numbers: list[int]) -> Iterator[tuple[int, YamlMap]]:
        section = block(self._device, direction.name, self._findings)
        for name, item in section.entries.items() if section else ():
            number = key_number(name, PDO_COUNT_MAX)
            if number not in numbers:
                self._findings.refuse(item.place, _no_such_pdo(direction, name, number, numbers))
            elif isinstance(item, YamlMap):
                yield number, item
            else:
                self._findings.error(
                    item.place,
                    f'expected the keys of a PDO, got {describe(item)}',
                    f"indent them below '{name}:'",
                )

    def _default(self, direction: Direction, number: int) -> PdoConfig:
        """Return a PDO as its EDS defines it."""
        communication = direction.communication + number - 1
        mapping = direction.mapping + number - 1
        entry = self._eds.dictionary.get(communication, 1)
        cob_id, transmission = (self._eds.dictionary.number(communication, sub) for sub in (1, 2))
        if cob_id is None:
            cob_id = COB_ID_INVALID
        enabled = not cob_id & (COB_ID_INVALID | COB_ID_EXTENDED) and bool(cob_id & CAN_ID_MASK)
        return PdoConfig(
            direction,
            number,
            enabled,
            cob_id & CAN_ID_MASK,
            TRANSMISSION_DEFAULT if transmission is None else transmission & 0xFF,
            mapping=eds_mapping(direction, number, self._eds, Findings()),
            configured=self._eds.dictionary.is_configured(communication, mapping),
            fixed_mapping=is_fixed(direction, number, self._eds.dictionary),
            assumed=entry is not None and entry.literal is not None,
            place=self._device.place,
            **self._times(direction, communication),
        )

    def _times(self, direction: Direction, communication: int) -> dict[str, Any]:
        """Return the times that a DCF sets for a PDO; the device keeps its other times."""
        found = {}
        for key in PDO_KEYS[direction.name]:
            subindex = SUBINDICES.get(key.field, 0)
            entry = self._eds.dictionary.get(communication, subindex) if subindex else None
            if entry is not None and entry.configured and isinstance(entry.default, int):
                found[key.field] = entry.default / (key.unit or 1)
        return found

    def _configured(self, pdo: PdoConfig, section: YamlMap) -> PdoConfig:
        """Override a PDO of the EDS with the values of bus.yml."""
        values = read_section(section, PDO_KEYS[pdo.direction.name], self._findings)
        self._check_parameters(pdo, section, values)
        fixed: dict[str, Any] = {'configured': True, 'place': section.place}
        pdo = replace(pdo, **{'enabled': True} | values | fixed)
        entries = listing(section, 'mapping', self._findings)
        if entries is not None:
            pdo = self._with_mapping(pdo, entries)
        if pdo.enabled and not (pdo.mapping or (entries and entries.items)):
            self._findings.error(
                section.place,
                f'{self._title(pdo)} is enabled, but maps nothing',
                "write its mapping, or 'enabled: false'",
            )
        return self._with_cob_id(pdo, section.entries.get('cob_id'))

    def _with_mapping(self, pdo: PdoConfig, entries: YamlList) -> PdoConfig:
        mapping = read_mapping(pdo, entries, self._eds, self._findings)
        if pdo.fixed_mapping and mapping != pdo.mapping:
            self._findings.error(
                entries.place,
                f'the mapping of {self._title(pdo)} is fixed (read-only in the EDS)',
                'remove it, the mapping of the EDS counts',
            )
        return replace(pdo, mapping=mapping)

    def _check_parameters(self, pdo: PdoConfig, section: YamlMap, values: dict[str, Any]) -> None:
        """Refuse parameters that the device lacks, and reserved or RTR transmission types."""
        for key in PDO_KEYS[pdo.direction.name]:
            address = pdo.communication, SUBINDICES.get(key.field, 0)
            if address[1] and key.field in values and address not in self._eds.dictionary:
                self._findings.error(
                    section.entries[key.name].place,
                    f'the device cannot do this: {object_address(*address)} is not in its EDS',
                    'remove the key',
                )
        transmission = values.get('transmission')
        if isinstance(transmission, int) and SYNCHRONOUS_MAX < transmission < EVENT_TYPES[0]:
            self._findings.error(
                section.entries['transmission'].place,
                f'transmission type {transmission} is reserved or requires remote frames',
                'take 0 to 240 (with SYNC), or 254 or 255 (on events)',
            )

    def _with_cob_id(self, pdo: PdoConfig, item: Item | None) -> PdoConfig:
        """Add the COB-ID: a number, ``auto`` or the EDS's own."""
        if item is None:
            if pdo.enabled and not pdo.cob_id:
                what = f'{self._title(pdo)} has no COB-ID in the EDS'
                self._findings.error(pdo.place, what, "write 'cob_id: auto'")
            return pdo
        pdo = replace(pdo, place=item.place)
        if isinstance(item, Scalar) and item.text.lower() == AUTO:
            if pdo.number <= PREDEFINED_MAX:
                own = pdo.direction.default_cob_id(pdo.number, self._node_id)
                return replace(pdo, cob_id=own)
            return replace(pdo, cob_id=AUTO_ID) if pdo.enabled else pdo
        if (cob_id := attempt(integer, item, self._findings)) is None:
            return pdo
        if 0 < cob_id <= CAN_ID_MASK:
            return replace(pdo, cob_id=cob_id)
        self._findings.error(
            item.place,
            f'{describe(item)} is no 11-bit identifier',
            "take 0x181 to 0x6DF or 'auto'; a PDO is switched off with 'enabled: false'",
        )
        return pdo


def _no_such_pdo(
    direction: Direction, name: str, number: int | None, numbers: list[int]
) -> RefusedError:
    """Return an error explaining why a key below ``tpdo`` or ``rpdo`` is no PDO of the device."""
    if any(key.name == name for key in PDO_KEYS[direction.name]):
        return RefusedError(
            f'{name!r} is no PDO number', f"indent {name!r} below a PDO number, such as '1:'"
        )
    if not number:
        return RefusedError(f'{name!r} is no PDO number', f'PDO numbers are 1 to {PDO_COUNT_MAX}')
    known = ', '.join(str(known) for known in numbers) or 'none'
    index = direction.communication + number - 1
    return RefusedError(
        f'{direction.title} {number} ({object_address(index)}) is not in the EDS',
        f'take one that the device has: {known}',
    )


SIGNED_BY_BITS = {bits: data_type for data_type, bits in SIGNED_BITS.items()}
UNSIGNED_BY_BITS = {1: DataType.BOOLEAN} | {bits: kind for kind, bits in UNSIGNED_BITS.items()}
"""How bits are read whose object the EDS does not describe."""

EDS_REMEDY = 'name its mapping in bus.yml, or correct the EDS'


def mapping_slots(direction: Direction, number: int, dictionary: ObjectDictionary) -> int:
    """Return the largest number of objects that a PDO can map by its EDS."""
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
    """Return the mapping of a PDO in the EDS; empty if it is invalid.

    Warn of mapped objects that the EDS lacks or that have another length there.
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
    # objects that CiA 402 defines as signed are decoded as signed
    signed = is_signed(index, subindex) and is_drive(dictionary)
    data_type = (SIGNED_BY_BITS if signed else UNSIGNED_BY_BITS).get(bits)
    result = 'the PDO is ignored' if data_type is None else f'taken as {data_type.name}'
    findings.warning(place, f'maps {what}; {result}', EDS_REMEDY)
    return None if data_type is None else MappedObject(index, subindex, data_type)


def read_mapping(
    pdo: PdoConfig, entries: YamlList, eds: Eds, findings: Findings
) -> tuple[MappedObject, ...]:
    """Read the list ``mapping`` of a PDO in bus.yml; report objects that cannot be mapped."""
    objects = (_mapped_object(pdo.direction, item, eds, findings) for item in entries.items)
    mapping = tuple(mapped for mapped in objects if mapped is not None)
    bits = sum(mapped.bits for mapped in mapping)
    slots = mapping_slots(pdo.direction, pdo.number, eds.dictionary)
    if bits > PDO_BITS_MAX:
        findings.error(
            entries.place,
            f'the mapped objects have {bits} bits together, a PDO carries at most {PDO_BITS_MAX}',
            'move objects to another PDO',
        )
    elif len(mapping) > slots:
        findings.error(
            entries.place,
            f'{len(mapping)} objects are mapped, {pdo.title} of this device takes at most {slots}',
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
    """Return a dummy entry: a data type in place of an object (CiA 301, 7.4.7.1)."""
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
