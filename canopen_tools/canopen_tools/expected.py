# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the objects of a device should hold by the files: identity, boot plan, or defaults."""

from __future__ import annotations

from collections.abc import Iterator

from arm_canopen.config.model import BusConfig, NodeConfig
from arm_canopen.config.model.boot_plan import BootWrite, held_after_boot, HeldConsumers
from arm_canopen.exceptions import CodecError
from arm_canopen.standard.datatypes import DataType, encode
from arm_canopen.standard.dictionary import ObjectDictionary

FROM_EDS = ('device_type', 'vendor_id', 'product_code')
"""The identity that the EDS has; the rest is in bus.yml."""


def expected_objects(
    config: BusConfig, node: NodeConfig, consumers: HeldConsumers | None = None
) -> list[BootWrite]:
    """Return everything that bus.yml decides of a device: its identity, and what boot leaves.

    Consumers are what the device has in 0x1016, by sub-index; None: those of its EDS.
    """
    return [*_identity(node), *held_after_boot(config, node, consumers)]


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
    for attribute, index, subindex, value in node.identity.objects:
        key = 'EDS' if attribute in FROM_EDS else attribute
        yield BootWrite(index, subindex, encode(DataType.UNSIGNED32, value), key)
