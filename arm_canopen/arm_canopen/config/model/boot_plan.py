# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Boot plan: the objects that the master writes to a device, and their values after the boot.

The boot downloads :func:`boot_writes`, and an exported DCF contains them; take-over and
``canopen diff`` compare a device with :func:`held_after_boot`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from canopen_core.standard import (
    CAN_ID_MASK,
    COB_ID_EXTENDED,
    COB_ID_INVALID,
    ConsumerHeartbeatTime,
    DataType,
    encode,
    Index,
    MAPPED_LENGTH_MASK,
    object_address,
    pdo_object,
    SYNC_PRODUCER,
    TIME_CONSUMER,
    TIME_PRODUCER,
)

from ..keys import HUNDRED_MICROSECONDS, MILLISECONDS
from .bus import BusConfig, EVENT_TIMER_SUBINDEX, NodeConfig, PdoConfig, SdoWrite, TPDO

COB_ID_BITS = COB_ID_INVALID | COB_ID_EXTENDED | CAN_ID_MASK
"""Bits that bus.yml decides of a COB-ID; the device has bit 30 as it can."""
BEFORE_PDOS = (Index.TIME_COB_ID, Index.ERROR_BEHAVIOUR)
"""Objects whose keys of their own are written before the PDOs, as dcfgen does."""
SERVICES_OFF: dict[tuple[int, int], tuple[int, int]] = {
    (Index.SYNC_COB_ID, 0): (SYNC_PRODUCER, 0),
    (Index.TIME_COB_ID, 0): (TIME_PRODUCER | TIME_CONSUMER, 0),
    (Index.EMCY_COB_ID, 0): (COB_ID_INVALID, COB_ID_INVALID),
}
"""Bits of a COB-ID, and their value while its identifier may change (CiA 301, 7.5.2)."""
ERROR_CONTROL = frozenset({Index.PRODUCER_HEARTBEAT, Index.GUARD_TIME, Index.LIFE_TIME_FACTOR})
"""Objects that are written from keys of their own, or else their defaults."""
WATCH_KEY = 'heartbeat_consumer'
TIMER_KEY = 'event_timer'
HeldConsumers = Mapping[int, int | None]
"""What a device holds in its entries of 0x1016, by sub-index; None where it refuses to be read."""


@dataclass(frozen=True, slots=True)
class BootWrite:
    """An object that is written to a device at boot."""

    index: int
    subindex: int
    data: bytes  # value, encoded for SDO
    key: str  # key of bus.yml, or file, that requests the write
    requested: bool = True  # bus.yml requests it; if False, a refusal is no error
    mask: int | None = None  # bits to write, None for all; the device keeps the others
    temporary: bool = False  # a later write replaces it, such as 0 before a mapping
    unless_default: bool = False  # an exported DCF omits it if it is the EDS default
    fixed: bool = False  # the value is fixed in the device, so it is not written

    @property
    def address(self) -> tuple[int, int]:
        """Index and sub-index."""
        return self.index, self.subindex

    @property
    def place(self) -> str:
        """The object, for messages."""
        return object_address(self.index, self.subindex)

    @property
    def is_own_timer(self) -> bool:
        """Whether it sets the event timer of a TPDO although bus.yml does not request it."""
        pdo, is_timer = pdo_object(self.index), self.subindex == EVENT_TIMER_SUBINDEX
        of_tpdo = pdo is not None and pdo.direction == TPDO.name and not pdo.is_mapping
        return of_tpdo and is_timer and not self.requested

    def text(self, held: bytes | None = None) -> str:
        """Format the masked bits of ``held``, or of its own data, as a hexadecimal number."""
        data = self.data if held is None else held
        value = int.from_bytes(data, 'little') & (self.mask if self.mask is not None else -1)
        return f'0x{value:0{2 * len(self.data)}X}'

    def over(self, present: int) -> bytes:
        """Return the data, with the bits outside the mask taken from the present value."""
        if self.mask is None:
            return self.data
        value = present & ~self.mask | int.from_bytes(self.data, 'little') & self.mask
        return value.to_bytes(len(self.data), 'little')

    def fits(self, held: bytes) -> bool:
        """Return whether a value read from the device matches the data within the mask."""
        pdo = pdo_object(self.index)
        if pdo is not None and pdo.is_mapping and self.subindex and held:
            held = bytes((held[0] & MAPPED_LENGTH_MASK,)) + held[1:]
        if self.mask is None or len(held) != len(self.data):
            return held == self.data
        return self.over(int.from_bytes(held, 'little')) == held


def boot_writes(
    bus: BusConfig, node: NodeConfig, consumers: HeldConsumers | None = None
) -> list[BootWrite]:
    """Return all writes to a device at boot, in the order of writing.

    ``consumers`` holds the entries of 0x1016 that were read from the device for
    :func:`consumer_to_read`; None uses the values of the EDS.
    """
    return list(_writes(bus, node, consumers))


def held_after_boot(
    bus: BusConfig, node: NodeConfig, consumers: HeldConsumers | None = None
) -> list[BootWrite]:
    """Return the objects of the device after its boot: all writes, and fixed mappings.

    ``consumers`` is as for :func:`boot_writes`.
    """
    fixed = (
        write
        for pdo in node.pdos
        if pdo.configured and pdo.enabled and pdo.fixed_mapping
        for write in _mapping(pdo, pdo.key, fixed=True)
    )
    writes = [*fixed, *assumed_cob_ids(node), *boot_writes(bus, node, consumers)]
    return list({write.address: write for write in writes}.values())  # the last one counts


def is_requested(bus: BusConfig, node: NodeConfig, *keys: str) -> bool:
    """Return whether bus.yml has a key of a device; True for a bus that a program built."""
    return not bus.locations or (node.name, *keys) in bus.locations


def consumer_to_read(bus: BusConfig, node: NodeConfig, held: HeldConsumers) -> int | None:
    """Return the entry of 0x1016 to read next; None once the entry for the master is known."""
    for subindex in _watch_slots(bus, node):
        if subindex not in held:
            return subindex
        if held[subindex] is None or _is_free(held, subindex, bus.master.node_id):
            return None  # only the EDS says that entries after an unreadable one exist
    return None


def _watch_slots(bus: BusConfig, node: NodeConfig) -> list[int]:
    """Return the entries of 0x1016 available for the master: no file uses them otherwise."""
    others = {w.subindex for w in node.sdo_writes if w.index == Index.CONSUMER_HEARTBEAT}
    for subindex, word in _consumers_of_dcf(node).items():
        if not _is_free_word(word, bus.master.node_id):
            others.add(subindex)
    return [
        entry.subindex
        for entry in node.dictionary.subindices(Index.CONSUMER_HEARTBEAT)
        if entry.subindex and entry.access.writable and entry.subindex not in others
    ]


def _is_free(held: HeldConsumers, subindex: int, master_id: int) -> bool:
    """Return whether an entry of 0x1016 is free; an unreadable one only if it is the first."""
    word = held.get(subindex)
    return subindex == 1 if word is None else _is_free_word(word, master_id)


def _is_free_word(word: int, master_id: int) -> bool:
    """Return whether an entry of 0x1016 is unused or watches the master."""
    entry = ConsumerHeartbeatTime.parse(word)
    return entry.node_id == master_id or not entry.used


def watch_word(bus: BusConfig, node: NodeConfig) -> int:
    """Return the value for the master's entry of 0x1016; 0 if the device must not watch it."""
    time = round(bus.master.heartbeat_timeout * MILLISECONDS)
    watched = node.heartbeat_consumer and time
    return ConsumerHeartbeatTime(bus.master.node_id, time).word if watched else 0


def _writes(
    bus: BusConfig, node: NodeConfig, consumers: HeldConsumers | None
) -> Iterator[BootWrite]:
    for write in node.parameter_writes:
        yield from _written(write)
    yield from _watch(bus, node, consumers)
    yield from _error_control(bus, node)
    leading = 0
    while leading < len(node.sdo_writes) and node.sdo_writes[leading].index in BEFORE_PDOS:
        leading += 1
    for write in node.sdo_writes[:leading]:
        yield from _written(write, unless_default=True)
    for pdo in node.rpdos + node.tpdos:
        if pdo.configured:
            yield from _pdo(bus, node, pdo)
        elif pdo.event_time is not None:  # a TPDO whose other parameters stay as in the device
            for parameter in _parameters(bus, node, pdo):
                if parameter.subindex == EVENT_TIMER_SUBINDEX:
                    yield parameter
    for write in node.sdo_writes[leading:]:
        yield from _written(write)


def _watch(
    bus: BusConfig, node: NodeConfig, consumers: HeldConsumers | None
) -> Iterator[BootWrite]:
    """Write the first free entry of 0x1016, so that the device watches the master or stops to."""
    master_id, index = bus.master.node_id, Index.CONSUMER_HEARTBEAT
    slots = _watch_slots(bus, node)
    if consumers is None:
        consumers = {slot: node.dictionary.number(index, slot) or 0 for slot in slots}
    entries = {**consumers, **_consumers_of_dcf(node)}  # the DCF is written earlier
    slot = next((sub for sub in slots if sub in entries and _is_free(entries, sub, master_id)), 0)
    word = watch_word(bus, node)
    own = ConsumerHeartbeatTime.parse(entries.get(slot) or 0).node_id == master_id
    if slot and (word or own):
        requested = is_requested(bus, node, WATCH_KEY)
        yield BootWrite(index, slot, encode(DataType.UNSIGNED32, word), WATCH_KEY, requested)


def _error_control(bus: BusConfig, node: NodeConfig) -> Iterator[BootWrite]:
    """Configure heartbeat and node guarding of the device (CiA 301, 7.2.8)."""
    period, guard_time = (
        round(time * MILLISECONDS) for time in (node.heartbeat_producer, node.guard_time)
    )
    u16, u8 = DataType.UNSIGNED16, DataType.UNSIGNED8
    for index, data_type, key, value in (
        (Index.PRODUCER_HEARTBEAT, u16, 'heartbeat_producer', period),
        (Index.GUARD_TIME, u16, 'guard_time', guard_time),
        (Index.LIFE_TIME_FACTOR, u8, 'life_time_factor', node.life_time_factor),
    ):
        entry = node.dictionary.get(index)
        if entry is None or not entry.access.writable:
            continue
        heartbeat = index is Index.PRODUCER_HEARTBEAT
        if heartbeat or node.uses_node_guarding or value != (entry.default or 0):
            data, requested = encode(data_type, value), is_requested(bus, node, key)
            yield BootWrite(index, 0, data, key, requested, unless_default=True)


def _pdo(bus: BusConfig, node: NodeConfig, pdo: PdoConfig) -> Iterator[BootWrite]:
    """Configure a PDO: disable, parameters, mapping, enable (CiA 301, 7.5.2.36)."""
    index, key = pdo.communication, pdo.key
    is_given = _is_given(bus, node, pdo, 'cob_id')
    yield BootWrite(
        index,
        1,
        encode(DataType.UNSIGNED32, pdo.cob_id | COB_ID_INVALID),
        f'{key}.cob_id' if pdo.enabled else f'{key}.enabled',
        requested=is_given or not pdo.enabled,
        mask=COB_ID_INVALID,
        temporary=pdo.enabled,
        unless_default=True,
    )
    if not pdo.enabled:
        return
    yield from _parameters(bus, node, pdo)
    if not pdo.fixed_mapping:
        given, temporary = _is_given(bus, node, pdo, 'mapping'), bool(pdo.mapping)
        zero, mapping_key = encode(DataType.UNSIGNED8, 0), f'{key}.mapping'
        yield BootWrite(pdo.mapping_index, 0, zero, mapping_key, given, temporary=temporary)
        yield from _mapping(pdo, mapping_key, requested=given)
    data = encode(DataType.UNSIGNED32, pdo.cob_id)
    yield BootWrite(index, 1, data, f'{key}.cob_id', is_given, mask=COB_ID_BITS)


def _parameters(bus: BusConfig, node: NodeConfig, pdo: PdoConfig) -> Iterator[BootWrite]:
    deadline = TIMER_KEY if pdo.direction is TPDO else 'event_deadline'
    event_time = _units(pdo.event_time, MILLISECONDS)
    for subindex, name, data_type, value in (
        (2, 'transmission', DataType.UNSIGNED8, pdo.transmission),
        (3, 'inhibit_time', DataType.UNSIGNED16, _units(pdo.inhibit_time)),
        (EVENT_TIMER_SUBINDEX, deadline, DataType.UNSIGNED16, event_time),
        (6, 'sync_start', DataType.UNSIGNED8, pdo.sync_start),
    ):
        if value is not None:
            data, given = encode(data_type, value), _is_given(bus, node, pdo, name)
            key = f'{pdo.key}.{name}'
            yield BootWrite(pdo.communication, subindex, data, key, given, unless_default=True)


def _mapping(
    pdo: PdoConfig, key: str, *, requested: bool = True, fixed: bool = False
) -> Iterator[BootWrite]:
    """Yield the writes of the mapped objects, then that of their number."""
    index, count = pdo.mapping_index, len(pdo.mapping)
    for subindex, mapped in enumerate(pdo.mapping, start=1):
        data = encode(DataType.UNSIGNED32, mapped.word)
        yield BootWrite(index, subindex, data, key, requested, fixed=fixed)
    if count:
        yield BootWrite(index, 0, encode(DataType.UNSIGNED8, count), key, requested, fixed=fixed)


def _is_given(bus: BusConfig, node: NodeConfig, pdo: PdoConfig, key: str) -> bool:
    """Return whether bus.yml sets a key of a PDO, or a DCF sets the object."""
    if is_requested(bus, node, pdo.direction.name, str(pdo.number), key):
        return True
    if key == TIMER_KEY:  # a DCF with other parameters may omit it
        entry = node.dictionary.get(pdo.communication, EVENT_TIMER_SUBINDEX)
        return entry is not None and entry.configured
    index = pdo.mapping_index if key == 'mapping' else pdo.communication
    return node.dictionary.is_configured(index)


def _consumers_of_dcf(node: NodeConfig) -> dict[int, int]:
    """Return the entries of 0x1016 that a DCF sets; they are written before the master's."""
    return {
        write.subindex: int.from_bytes(write.data, 'little')
        for write in node.parameter_writes
        if write.index == Index.CONSUMER_HEARTBEAT
    }


def assumed_cob_ids(node: NodeConfig) -> Iterator[BootWrite]:
    """Yield the COB-IDs expected from the node id where the EDS states others."""
    for pdo in node.pdos:
        if pdo.assumed and pdo.enabled and not pdo.configured:
            data = encode(DataType.UNSIGNED32, pdo.cob_id)
            yield BootWrite(pdo.communication, 1, data, pdo.key, mask=COB_ID_BITS, fixed=True)


def _written(write: SdoWrite, *, unless_default: bool = False) -> Iterator[BootWrite]:
    """Yield a write from a file, preceded for a COB-ID by one that disables its service."""
    address, place = (write.index, write.subindex), write.place
    key = f'{place.key} (line {place.line})' if place.line else place.key or 'bus.yml'
    value = int.from_bytes(write.data, 'little')
    mask, off = SERVICES_OFF.get(address, (0, 0))
    if value & mask != off:
        off |= value & ~mask
        ended = encode(DataType.UNSIGNED32, off)
        yield BootWrite(*address, ended, key, mask=mask, temporary=True)
        unless_default = False  # else an exported DCF would leave the service disabled
    yield BootWrite(*address, write.data, key, unless_default=unless_default)


def _units(time: float | None, per_second: float = HUNDRED_MICROSECONDS) -> int | None:
    return None if time is None else round(time * per_second)
