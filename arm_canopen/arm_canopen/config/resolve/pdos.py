# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The PDOs of a device: those of its EDS, changed by bus.yml."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from canopen_core import Findings, Place, RefusedError
from canopen_core.eds import Eds
from canopen_core.standard import (
    CAN_ID_MASK,
    COB_ID_EXTENDED,
    COB_ID_INVALID,
    object_address,
    PDO_COUNT_MAX,
    PREDEFINED_MAX,
    SYNCHRONOUS_MAX,
)

from ..model.pdo import Direction, PdoConfig, RPDO, TPDO
from ..read.document import Item, Scalar, YamlList, YamlMap
from ..read.scalars import describe, integer, key_number
from ..read.section import block, listing, read_section
from ..sections import RPDO_KEYS, TPDO_KEYS
from .pdo_mapping import eds_mapping, is_fixed, read_mapping

PDO_KEYS = {TPDO.name: TPDO_KEYS, RPDO.name: RPDO_KEYS}
"""The keys of one PDO."""
AUTO, AUTO_ID = 'auto', -1  # a COB-ID from the free range, which is given when all are known
TRANSMISSION_DEFAULT = 255
EVENT_TYPES = (254, 255)
SUBINDICES = {'inhibit_time': 3, 'event_time': 5, 'sync_start': 6}
"""Sub-indices of the communication parameter that not every device has (CiA 301, 7.5.2.37)."""


class PdoReader:
    """Reads the PDOs of one device."""

    def __init__(
        self, name: str, device: YamlMap, eds: Eds, node_id: int, *, findings: Findings
    ) -> None:
        """Prepare for a device, whose EDS has node-relative defaults resolved."""
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
                pdo = self._configured(direction, pdo, wanted[number])
            elif pdo.enabled:
                # the warnings of this mapping matter, as the PDO is in use
                eds_mapping(direction, number, self._eds, self._findings)
                self._warn_of_assumption(direction, pdo)
            pdos.append(pdo)
        return tuple(pdos)

    def _title(self, direction: Direction, pdo: PdoConfig) -> str:
        return f'{direction.title} {pdo.number} of {self._name}'

    def _warn_of_assumption(self, direction: Direction, pdo: PdoConfig) -> None:
        """Report a COB-ID that the file has for another node id, which boot looks up."""
        entry = self._eds.dictionary.get(direction.communication + pdo.number - 1, 1)
        if entry is not None and entry.literal is not None and pdo.mapping:
            self._findings.warning(
                Place(self._eds.path, entry.line, f'[{entry.index:04X}sub1]'),
                f'COB-ID 0x{entry.literal & CAN_ID_MASK:03X} of {self._title(direction, pdo)} is '
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
        """Describe a PDO as its EDS does."""
        communication = direction.communication + number - 1
        mapping = direction.mapping + number - 1
        entry = self._eds.dictionary.get(communication, 1)
        cob_id, transmission = (self._eds.dictionary.number(communication, sub) for sub in (1, 2))
        if cob_id is None:
            cob_id = COB_ID_INVALID
        enabled = not cob_id & (COB_ID_INVALID | COB_ID_EXTENDED) and bool(cob_id & CAN_ID_MASK)
        return PdoConfig(
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
        """Return the times that a DCF gives a PDO; others are left to the device."""
        found = {}
        for key in PDO_KEYS[direction.name]:
            subindex = SUBINDICES.get(key.field, 0)
            entry = self._eds.dictionary.get(communication, subindex) if subindex else None
            if entry is not None and entry.configured and isinstance(entry.default, int):
                found[key.field] = entry.default / (key.unit or 1)
        return found

    def _configured(self, direction: Direction, pdo: PdoConfig, section: YamlMap) -> PdoConfig:
        """Lay the values of bus.yml over a PDO of the EDS."""
        values = read_section(section, PDO_KEYS[direction.name], self._findings)
        self._check_parameters(direction, pdo, section, values)
        fixed: dict[str, Any] = {'configured': True, 'place': section.place}
        pdo = replace(pdo, **{'enabled': True} | values | fixed)
        entries = listing(section, 'mapping', self._findings)
        if entries is not None:
            pdo = self._with_mapping(direction, pdo, entries)
        if pdo.enabled and not (pdo.mapping or (entries and entries.items)):
            self._findings.error(
                section.place,
                f'{self._title(direction, pdo)} is enabled, but maps nothing',
                "write its mapping, or 'enabled: false'",
            )
        return self._with_cob_id(direction, pdo, section.entries.get('cob_id'))

    def _with_mapping(self, direction: Direction, pdo: PdoConfig, entries: YamlList) -> PdoConfig:
        mapping = read_mapping(direction, pdo.number, entries, self._eds, self._findings)
        if pdo.fixed_mapping and mapping != pdo.mapping:
            self._findings.error(
                entries.place,
                f'the mapping of {self._title(direction, pdo)} is fixed (read-only in the EDS)',
                'remove it, the mapping of the EDS counts',
            )
        return replace(pdo, mapping=mapping)

    def _check_parameters(
        self, direction: Direction, pdo: PdoConfig, section: YamlMap, values: dict[str, Any]
    ) -> None:
        """Refuse what the device has no sub-index for, and transmission types without use."""
        communication = direction.communication + pdo.number - 1
        for key in PDO_KEYS[direction.name]:
            subindex = SUBINDICES.get(key.field)
            if subindex is None or key.field not in values:
                continue
            if (communication, subindex) not in self._eds.dictionary:
                self._findings.error(
                    section.entries[key.name].place,
                    f'the device cannot do this: {object_address(communication, subindex)} is not '
                    'in its EDS',
                    'remove the key',
                )
        transmission = values.get('transmission')
        if isinstance(transmission, int) and SYNCHRONOUS_MAX < transmission < EVENT_TYPES[0]:
            self._findings.error(
                section.entries['transmission'].place,
                f'transmission type {transmission} is reserved or requires remote frames',
                'take 0 to 240 (with SYNC), or 254 or 255 (on events)',
            )

    def _with_cob_id(self, direction: Direction, pdo: PdoConfig, item: Item | None) -> PdoConfig:
        """Add the COB-ID: a number, ``auto`` or the EDS's own."""
        if item is None:
            if pdo.enabled and not pdo.cob_id:
                what = f'{self._title(direction, pdo)} has no COB-ID in the EDS'
                self._findings.error(pdo.place, what, "write 'cob_id: auto'")
            return pdo
        pdo = replace(pdo, place=item.place)
        if isinstance(item, Scalar) and item.text.lower() == AUTO:
            if pdo.number <= PREDEFINED_MAX:
                return replace(pdo, cob_id=direction.default_cob_id(pdo.number, self._node_id))
            return replace(pdo, cob_id=AUTO_ID) if pdo.enabled else pdo
        try:
            return replace(pdo, cob_id=_explicit(item))
        except RefusedError as reason:
            self._findings.refuse(item.place, reason)
            return pdo


def _no_such_pdo(
    direction: Direction, name: str, number: int | None, numbers: list[int]
) -> RefusedError:
    """Explain why a key below ``tpdo`` or ``rpdo`` is no PDO of the device."""
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


def _explicit(item: Item) -> int:
    cob_id = integer(item)
    if not 0 < cob_id <= CAN_ID_MASK:
        raise RefusedError(
            f'{describe(item)} is no 11-bit identifier',
            "take 0x181 to 0x6DF or 'auto'; a PDO is switched off with 'enabled: false'",
        )
    return cob_id
