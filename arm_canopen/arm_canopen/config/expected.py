# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the objects of a device should hold by the files: what bus.yml asks for, or defaults."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass

from ..exceptions import CodecError
from ..standard.cob_id import CAN_ID_MASK, COB_ID_EXTENDED, COB_ID_INVALID
from ..standard.datatypes import DataType, encode
from ..standard.dictionary import ObjectDictionary
from ..standard.objects import Index
from .master_model import MasterConfig
from .model import BusConfig, NodeConfig, PdoConfig, SdoWrite, Written
from .pdo_direction import Direction, RPDO, TPDO
from .shared_keys import HUNDRED_MICROSECONDS, MILLISECONDS

COB_ID_BITS = COB_ID_INVALID | COB_ID_EXTENDED | CAN_ID_MASK
"""Bits that bus.yml decides of a COB-ID; the device has bit 30 as it can."""
IDENTITY_SUBINDICES = (
    ('vendor_id', 1),
    ('product_code', 2),
    ('revision_number', 3),
    ('serial_number', 4),
)


@dataclass(frozen=True, slots=True)
class Expected:
    """What an object should hold.

    Attributes:
        index: Object index.
        subindex: Sub-index.
        data: Its value as an SDO carries it.
        key: Key of bus.yml, or file, that says so.
        mask: Bits that count, None for all.
    """

    index: int
    subindex: int
    data: bytes
    key: str
    mask: int | None = None

    def fits(self, data: bytes) -> bool:
        """Tell whether a value of the device is what is expected; padding does not matter."""
        if len(self.data) <= 4 and len(data) == 4:
            data = data[: len(self.data)]
        if self.mask is None or len(data) != len(self.data):
            return data == self.data
        wanted, held = int.from_bytes(self.data, 'little'), int.from_bytes(data, 'little')
        return wanted & self.mask == held & self.mask


def expected_objects(config: BusConfig, node: NodeConfig) -> list[Expected]:
    """Return everything that bus.yml decides of a device, in the order in which it is written."""
    expected = [
        *_identity(node),
        *_writes(node.parameter_writes),
        *_error_control(config.master, node),
        *(item for pdo in node.rpdos for item in _pdo(RPDO, pdo)),
        *(item for pdo in node.tpdos for item in _pdo(TPDO, pdo)),
        *_writes(node.sdo_writes),
    ]
    # of two writes of an object the last one counts
    return list({(item.index, item.subindex): item for item in expected}.values())


def expected_defaults(dictionary: ObjectDictionary) -> list[Expected]:
    """Return what every object that can be read and written holds by its EDS."""
    return list(_defaults(dictionary))


def _defaults(dictionary: ObjectDictionary) -> Iterator[Expected]:
    for entry in dictionary:
        if entry.default is None or not (entry.access.readable and entry.access.writable):
            continue
        try:
            data = encode(entry.data_type, entry.default)
        except CodecError:
            continue
        yield Expected(*entry.address, data, 'EDS')


def _writes(writes: Iterable[SdoWrite]) -> Iterator[Expected]:
    for write in writes:
        yield Expected(write.index, write.subindex, write.data, _key(write.written))


def _key(written: Written) -> str:
    return f'{written.key} (line {written.line})' if written.line else written.key or 'bus.yml'


def _identity(node: NodeConfig) -> Iterator[Expected]:
    if node.identity.device_type:
        yield _number(Index.DEVICE_TYPE, 0, node.identity.device_type, DataType.UNSIGNED32, 'EDS')
    for attribute, subindex in IDENTITY_SUBINDICES:
        value = getattr(node.identity, attribute)
        if value:
            key = 'EDS' if subindex <= 2 else attribute
            yield _number(Index.IDENTITY, subindex, value, DataType.UNSIGNED32, key)


def _error_control(master: MasterConfig, node: NodeConfig) -> Iterator[Expected]:
    """Return heartbeats (CiA 301, 7.5.2.17 and 7.5.2.18)."""
    if _is_writable(node, Index.PRODUCER_HEARTBEAT, 0):
        period = round(node.heartbeat_producer * MILLISECONDS)
        key = 'heartbeat_producer'
        yield _number(Index.PRODUCER_HEARTBEAT, 0, period, DataType.UNSIGNED16, key)
    if node.guarded:
        time, factor = round(node.guard_time * MILLISECONDS), node.life_time_factor
        yield _number(Index.GUARD_TIME, 0, time, DataType.UNSIGNED16, 'guard_time')
        yield _number(Index.LIFE_TIME_FACTOR, 0, factor, DataType.UNSIGNED8, 'life_time_factor')
    watch = watch_entry(master, node)
    if watch is not None:
        key = 'heartbeat_consumer'
        yield _number(Index.CONSUMER_HEARTBEAT, *watch, DataType.UNSIGNED32, key)


def watch_entry(master: MasterConfig, node: NodeConfig) -> tuple[int, int] | None:
    """Return the entry of 0x1016 by which a device watches the master, or no longer does.

    It is the one that is the master's by the EDS, or else the first that watches nobody.

    Returns:
        Sub-index and value; None when none is to be written, or there is no room.
    """
    others = {w.subindex for w in node.sdo_writes if w.index == Index.CONSUMER_HEARTBEAT}
    entries = {
        entry.subindex: entry.default if isinstance(entry.default, int) else 0
        for entry in node.dictionary.subindices(Index.CONSUMER_HEARTBEAT)
        if entry.subindex and entry.access.writable and entry.subindex not in others
    }
    own = [sub for sub, value in entries.items() if value >> 16 & 0xFF == master.node_id]
    free = [sub for sub, value in entries.items() if not value & 0xFFFF or not value >> 16]
    if node.heartbeat_consumer and (own or free):
        time = round(master.heartbeat_timeout * MILLISECONDS)
        return (own or free)[0], master.node_id << 16 | time
    return (own[0], 0) if own else None


def _is_writable(node: NodeConfig, index: int, subindex: int) -> bool:
    entry = node.dictionary.get(index, subindex)
    return entry is not None and entry.access.writable


def _pdo(direction: Direction, pdo: PdoConfig) -> Iterator[Expected]:
    """Return communication and mapping parameter of a PDO that bus.yml names."""
    if not pdo.configured:
        return
    index, key = direction.communication + pdo.number - 1, f'{direction.name}.{pdo.number}'
    unsigned = DataType.UNSIGNED32
    if not pdo.enabled:
        yield _number(index, 1, COB_ID_INVALID, unsigned, f'{key}.enabled', mask=COB_ID_INVALID)
        return
    yield _number(index, 1, pdo.cob_id, unsigned, f'{key}.cob_id', mask=COB_ID_BITS)
    yield _number(index, 2, pdo.transmission, DataType.UNSIGNED8, f'{key}.transmission')
    for subindex, name, data_type, value in (
        (3, 'inhibit_time', DataType.UNSIGNED16, _units(pdo.inhibit_time, HUNDRED_MICROSECONDS)),
        (5, 'event_timer', DataType.UNSIGNED16, _units(pdo.event_time, MILLISECONDS)),
        (6, 'sync_start', DataType.UNSIGNED8, pdo.sync_start),
    ):
        if value is not None:
            yield _number(index, subindex, value, data_type, f'{key}.{name}')
    mapping = direction.mapping + pdo.number - 1
    yield _number(mapping, 0, len(pdo.mapping), DataType.UNSIGNED8, f'{key}.mapping')
    for subindex, mapped in enumerate(pdo.mapping, start=1):
        yield _number(mapping, subindex, mapped.word, unsigned, f'{key}.mapping')


def _units(time: float | None, per_second: float) -> int | None:
    return None if time is None else round(time * per_second)


def _number(
    index: int,
    subindex: int,
    value: int,
    data_type: DataType,
    key: str,
    *,
    mask: int | None = None,
) -> Expected:
    return Expected(index, subindex, encode(data_type, value), key, mask)
