# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Concise DCFs: the writes that configure a device, in one binary file (CiA 302-3, 0x1F22).

A file is the number of writes as UNSIGNED32, and then for each index (UNSIGNED16), sub-index
(UNSIGNED8), length of the data in [byte] (UNSIGNED32) and the data; all of it little-endian.
"""

from __future__ import annotations

from collections.abc import Iterable
import struct

from arm_canopen.config import boot_writes, BootWrite, BusConfig, NodeConfig, SdoWrite
from canopen_core.standard import (
    COB_ID_INVALID,
    DataType,
    encode,
    Index,
    ObjectEntry,
    pdo_object,
)

COUNT = struct.Struct('<I')
ENTRY = struct.Struct('<HBI')

EXPECTED_REVISION = 0x1F87  # of the devices, in the master's dictionary (CiA 302-2)
EXPECTED_SERIAL = 0x1F88


def encode_concise(writes: Iterable[SdoWrite]) -> bytes:
    """Return a concise DCF."""
    entries = [ENTRY.pack(w.index, w.subindex, len(w.data)) + w.data for w in writes]
    return COUNT.pack(len(entries)) + b''.join(entries)


def device_writes(
    config: BusConfig, node: NodeConfig, *, complete: bool = False
) -> list[SdoWrite]:
    """Return what a master writes to a device at boot, in the order of dcfgen.

    Complete also writes what the EDS has as default; dcfgen leaves it out, so a device that
    holds something else keeps it.
    """
    return [
        SdoWrite(*write.address, _value(node, write))
        for write in boot_writes(config, node)
        if _is_needed(node, write, complete=complete)
    ]


def master_writes(config: BusConfig) -> list[SdoWrite]:
    """Return what the master writes to its own dictionary; none makes the file unnecessary."""
    writes = []
    serial = config.master.identity.serial_number
    if serial:
        writes.append(_u32(Index.IDENTITY, 4, serial))
    for node in config.nodes:
        for index, number in (
            (EXPECTED_REVISION, node.identity.revision_number),
            (EXPECTED_SERIAL, node.identity.serial_number),
        ):
            if number:
                writes.append(_u32(index, node.node_id, number))
    return writes


def _u32(index: int, subindex: int, value: int) -> SdoWrite:
    return SdoWrite(index, subindex, encode(DataType.UNSIGNED32, value))


def _is_needed(node: NodeConfig, write: BootWrite, *, complete: bool) -> bool:
    """Return whether dcfgen writes it: no mapping or timer of our own, and no defaults.

    Our boot tries those, and goes on where the device refuses them; another master would fail.
    """
    pdo = pdo_object(write.index)
    is_own_mapping = pdo is not None and pdo.is_mapping and not write.requested
    if write.is_own_timer or is_own_mapping:
        return False
    if complete or not write.unless_default:
        return True
    entry = _entry(node, write)
    if entry is None or entry.default is None:
        return True
    return _value(node, write) != encode(entry.data_type, entry.default)


def _value(node: NodeConfig, write: BootWrite) -> bytes:
    """Return the data; what bus.yml leaves open of a COB-ID stays as the EDS has it."""
    entry = _entry(node, write)
    present = entry.default if entry is not None else None
    if write.mask is None or not isinstance(present, int):
        return write.data
    if write.mask == COB_ID_INVALID:
        return write.data if write.temporary and write.requested else write.over(present)
    is_open = not write.requested and not present & COB_ID_INVALID
    return encode(DataType.UNSIGNED32, present) if is_open else write.data


def _entry(node: NodeConfig, write: BootWrite) -> ObjectEntry | None:
    """Return what the EDS has; what a device has without its DCF is not known any more."""
    entry = node.dictionary.get(*write.address)
    return None if entry is None or entry.configured else entry
