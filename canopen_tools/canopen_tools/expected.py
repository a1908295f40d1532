# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the objects of a device should hold by the files: what bus.yml asks for, or defaults."""

from __future__ import annotations

from collections.abc import Iterator

from arm_canopen.config.boot_plan import boot_writes, BootWrite, final_values
from arm_canopen.config.model import BusConfig, NodeConfig
from arm_canopen.config.pdo_direction import RPDO, TPDO
from arm_canopen.exceptions import CodecError
from arm_canopen.standard.datatypes import DataType, encode
from arm_canopen.standard.dictionary import ObjectDictionary
from arm_canopen.standard.objects import Index

IDENTITY_SUBINDICES = (
    ('vendor_id', 1),
    ('product_code', 2),
    ('revision_number', 3),
    ('serial_number', 4),
)


def expected_objects(config: BusConfig, node: NodeConfig) -> list[BootWrite]:
    """Return everything that bus.yml decides of a device: its identity, and what boot writes."""
    return final_values(
        [*_identity(node), *_fixed_mappings(node), *boot_writes(config, node)],
    )


def expected_defaults(dictionary: ObjectDictionary) -> list[BootWrite]:
    """Return what every object that can be read and written holds by its EDS."""
    return list(_defaults(dictionary))


def _defaults(dictionary: ObjectDictionary) -> Iterator[BootWrite]:
    for entry in dictionary:
        if entry.default is None or not (entry.access.readable and entry.access.writable):
            continue
        try:
            data = encode(entry.data_type, entry.default)
        except CodecError:
            continue
        yield BootWrite(*entry.address, data, 'EDS')


def _identity(node: NodeConfig) -> Iterator[BootWrite]:
    if node.identity.device_type:
        yield _number(Index.DEVICE_TYPE, 0, node.identity.device_type, DataType.UNSIGNED32, 'EDS')
    for attribute, subindex in IDENTITY_SUBINDICES:
        value = getattr(node.identity, attribute)
        if value:
            key = 'EDS' if subindex <= 2 else attribute
            yield _number(Index.IDENTITY, subindex, value, DataType.UNSIGNED32, key)


def _fixed_mappings(node: NodeConfig) -> Iterator[BootWrite]:
    """Return the mappings that a device has for ever, which are not written."""
    for direction, pdos in ((RPDO, node.rpdos), (TPDO, node.tpdos)):
        for pdo in pdos:
            if pdo.configured and pdo.enabled and pdo.fixed_mapping:
                index, key = direction.mapping + pdo.number - 1, f'{direction.name}.{pdo.number}'
                yield _number(index, 0, len(pdo.mapping), DataType.UNSIGNED8, key)
                for subindex, mapped in enumerate(pdo.mapping, start=1):
                    yield _number(index, subindex, mapped.word, DataType.UNSIGNED32, key)


def _number(index: int, subindex: int, value: int, data_type: DataType, key: str) -> BootWrite:
    return BootWrite(index, subindex, encode(data_type, value), key)
