# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Concise DCFs: the writes that configure a device, in one binary file (CiA 302-3, 0x1F22).

A file is the number of writes as UNSIGNED32, and then for each index (UNSIGNED16), sub-index
(UNSIGNED8), length of the data in [byte] (UNSIGNED32) and the data; all of it little-endian.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
import struct

from ..standard.cob_id import COB_ID_INVALID
from ..standard.datatypes import DataType, encode, Value
from ..standard.objects import Index
from .expected import watch_entry
from .model import BusConfig, NodeConfig, PdoConfig, SdoWrite
from .parameter_values import is_configured
from .pdo_direction import Direction, RPDO, TPDO
from .shared_keys import HUNDRED_MICROSECONDS, MILLISECONDS

COUNT = struct.Struct('<I')
ENTRY = struct.Struct('<HBI')
BEFORE_PDOS = (Index.TIME_COB_ID, Index.ERROR_BEHAVIOUR)
"""Objects whose keys of their own are written before the PDOs."""

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

    Args:
        config: The bus.
        node: The device.
        complete: Write also what the EDS has as default; dcfgen leaves it out, so a device that
            holds something else keeps it.
    """
    leading = 0
    while leading < len(node.sdo_writes) and node.sdo_writes[leading].index in BEFORE_PDOS:
        leading += 1
    writer = _Writer(config, node, complete=complete)
    return [
        *node.parameter_writes,
        *writer.consumer_heartbeat(),
        *writer.error_control(),
        *writer.changed(node.sdo_writes[:leading]),
        *(write for pdo in node.rpdos for write in writer.pdo(RPDO, pdo)),
        *(write for pdo in node.tpdos for write in writer.pdo(TPDO, pdo)),
        *node.sdo_writes[leading:],
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


class _Writer:
    """Lists the writes for one device."""

    def __init__(self, config: BusConfig, node: NodeConfig, *, complete: bool) -> None:
        self._config = config
        self._node = node
        self._complete = complete

    def consumer_heartbeat(self) -> Iterator[SdoWrite]:
        """Have the device watch the master, or no longer."""
        watch = watch_entry(self._config.master, self._node)
        if watch is not None:
            yield self._write(Index.CONSUMER_HEARTBEAT, *watch)

    def error_control(self) -> Iterator[SdoWrite]:
        """Set the heartbeat of the device, and node guarding."""
        node = self._node
        for index, value in (
            (Index.PRODUCER_HEARTBEAT, round(node.heartbeat_producer * MILLISECONDS)),
            (Index.GUARD_TIME, round(node.guard_time * MILLISECONDS)),
            (Index.LIFE_TIME_FACTOR, node.life_time_factor),
        ):
            entry = node.dictionary.get(index)
            if entry is not None and entry.access.writable:
                yield from self._changed(index, 0, value)

    def changed(self, writes: Iterable[SdoWrite]) -> Iterator[SdoWrite]:
        """Leave out what the EDS has as default."""
        for write in writes:
            entry = self._node.dictionary.get(write.index, write.subindex)
            default = entry.default if entry is not None else None
            if (
                self._complete
                or entry is None
                or default is None
                or write.data != encode(entry.data_type, default)
            ):
                yield write

    def pdo(self, direction: Direction, pdo: PdoConfig) -> Iterator[SdoWrite]:
        """Configure a PDO: disable, parameters, mapping, enable (CiA 301, 7.5.2.36)."""
        if not pdo.configured:
            return
        index = direction.communication + pdo.number - 1
        present = self._default(index, 1)
        present = COB_ID_INVALID if present is None else present
        cob_id = self._cob_id(direction, pdo, present)
        if self._complete or present != cob_id | COB_ID_INVALID:
            yield self._write(index, 1, cob_id | COB_ID_INVALID)
        if cob_id & COB_ID_INVALID:
            return
        yield from self._parameters(index, pdo)
        if self._is_given(direction, pdo, 'mapping') and not pdo.fixed_mapping:
            yield from self._mapping(direction.mapping + pdo.number - 1, pdo)
        if pdo.enabled:
            yield self._write(index, 1, cob_id)

    def _cob_id(self, direction: Direction, pdo: PdoConfig, present: int) -> int:
        """Return the COB-ID that a PDO shall have; what bus.yml leaves open stays."""
        wanted = self._is_given(direction, pdo, 'cob_id')
        if wanted or (pdo.enabled and present & COB_ID_INVALID):
            return pdo.cob_id
        return present

    def _parameters(self, index: int, pdo: PdoConfig) -> Iterator[SdoWrite]:
        yield from self._changed(index, 2, pdo.transmission)
        for subindex, value in (
            (3, _units(pdo.inhibit_time, HUNDRED_MICROSECONDS)),
            (5, _units(pdo.event_time, MILLISECONDS)),
            (6, pdo.sync_start),
        ):
            if value is not None:
                yield from self._changed(index, subindex, value)

    def _mapping(self, index: int, pdo: PdoConfig) -> Iterator[SdoWrite]:
        if self._default(index, 0) or pdo.mapping:
            yield self._write(index, 0, 0)
        for subindex, mapped in enumerate(pdo.mapping, start=1):
            yield self._write(index, subindex, mapped.word)
        if pdo.mapping:
            yield self._write(index, 0, len(pdo.mapping))

    def _is_given(self, direction: Direction, pdo: PdoConfig, key: str) -> bool:
        """Tell whether bus.yml or the DCF gives a key; a bus from elsewhere gives all."""
        written = self._config.written
        if not written or (self._node.name, direction.name, str(pdo.number), key) in written:
            return True
        objects = {'cob_id': direction.communication, 'mapping': direction.mapping}
        return is_configured(self._node.dictionary, objects[key] + pdo.number - 1)

    def _default(self, index: int, subindex: int) -> int | None:
        entry = self._node.dictionary.get(index, subindex)
        if entry is None or entry.configured:
            return None  # what the device has without the DCF is not known any more
        return entry.default if isinstance(entry.default, int) else None

    def _changed(self, index: int, subindex: int, value: int) -> Iterator[SdoWrite]:
        if self._complete or value != self._default(index, subindex):
            yield self._write(index, subindex, value)

    def _write(self, index: int, subindex: int, value: Value) -> SdoWrite:
        entry = self._node.dictionary.get(index, subindex)
        data_type = entry.data_type if entry is not None else DataType.UNSIGNED8
        return SdoWrite(index, subindex, encode(data_type, value))


def _units(time: float | None, per_second: float) -> int | None:
    return None if time is None else round(time * per_second)
