# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is written to a device at boot, and what it holds then: the one list of all that need it.

Boot downloads :func:`boot_writes`, and a DCF holds them; take-over and ``canopen diff`` compare
:func:`held_after_boot`.
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
    data: bytes  # its value as an SDO carries it
    key: str  # key of bus.yml, or file, that it comes from
    requested: bool = True  # bus.yml has it; a refusal of other writes is no error
    mask: int | None = None  # bits that count, None for all; the device keeps the others
    temporary: bool = False  # it makes room for the writes that follow, and does not stay
    unless_default: bool = False  # an exported DCF leaves it out where the EDS has it as default
    fixed: bool = False  # the device has it for good, so it is not written

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
        """Whether it sets the event timer of a TPDO without a request of bus.yml."""
        pdo, is_timer = pdo_object(self.index), self.subindex == EVENT_TIMER_SUBINDEX
        of_tpdo = pdo is not None and pdo.direction == TPDO.name and not pdo.is_mapping
        return of_tpdo and is_timer and not self.requested

    def text(self, held: bytes | None = None) -> str:
        """Write the bits that count as a hexadecimal number: its own, or those of a device."""
        data = self.data if held is None else held
        value = int.from_bytes(data, 'little') & (self.mask if self.mask is not None else -1)
        return f'0x{value:0{2 * len(self.data)}X}'

    def over(self, present: int) -> bytes:
        """Return the data with the bits that do not count as they are in a present value."""
        if self.mask is None:
            return self.data
        value = present & ~self.mask | int.from_bytes(self.data, 'little') & self.mask
        return value.to_bytes(len(self.data), 'little')

    def fits(self, held: bytes) -> bool:
        """Return whether a value of the device is what is wanted."""
        pdo = pdo_object(self.index)
        if pdo is not None and pdo.is_mapping and self.subindex and held:
            held = bytes((held[0] & MAPPED_LENGTH_MASK,)) + held[1:]
        if self.mask is None or len(held) != len(self.data):
            return held == self.data
        return self.over(int.from_bytes(held, 'little')) == held


def boot_writes(
    bus: BusConfig, node: NodeConfig, consumers: HeldConsumers | None = None
) -> list[BootWrite]:
    """Return everything that is written to a device at boot, in this order.

    What the device holds in 0x1016 is read while :func:`consumer_to_read` names an entry; None
    takes it from its EDS.
    """
    return list(_writes(bus, node, consumers))


def held_after_boot(
    bus: BusConfig, node: NodeConfig, consumers: HeldConsumers | None = None
) -> list[BootWrite]:
    """Return what the device holds after its boot: what was written, and mappings that it has.

    Consumers are those of :func:`boot_writes`.
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
    """Return whether bus.yml has a key of a device; a bus that was built by a program has all."""
    return not bus.locations or (node.name, *keys) in bus.locations


def consumer_to_read(bus: BusConfig, node: NodeConfig, held: HeldConsumers) -> int | None:
    """Return the entry of 0x1016 to read next after those held; None: the master's is known."""
    for subindex in _watch_slots(bus, node):
        if subindex not in held:
            return subindex
        if held[subindex] is None or _is_free(held, subindex, bus.master.node_id):
            return None  # entries behind one that cannot be read are promised by the EDS only
    return None


def _watch_slots(bus: BusConfig, node: NodeConfig) -> list[int]:
    """Return the entries of 0x1016 that may be the master's: no file has another use for them."""
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
    """Return whether an entry of 0x1016 is free; the first is where it cannot be read."""
    word = held.get(subindex)
    return subindex == 1 if word is None else _is_free_word(word, master_id)


def _is_free_word(word: int, master_id: int) -> bool:
    """Return whether an entry of 0x1016 is unused, or the master's."""
    entry = ConsumerHeartbeatTime.parse(word)
    return entry.node_id == master_id or not entry.used


def watch_word(bus: BusConfig, node: NodeConfig) -> int:
    """Return what the entry of 0x1016 for the master shall hold; 0 for not to watch it."""
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
        elif pdo.event_time is not None:  # of a TPDO that is otherwise left as the device has it
            for parameter in _parameters(bus, node, pdo):
                if parameter.subindex == EVENT_TIMER_SUBINDEX:
                    yield parameter
    for write in node.sdo_writes[leading:]:
        yield from _written(write)


def _watch(
    bus: BusConfig, node: NodeConfig, consumers: HeldConsumers | None
) -> Iterator[BootWrite]:
    """Make the device watch the master, or stop it, in the first entry that is free."""
    master_id, index = bus.master.node_id, Index.CONSUMER_HEARTBEAT
    slots = _watch_slots(bus, node)
    if consumers is None:
        consumers = {slot: node.dictionary.number(index, slot) or 0 for slot in slots}
    entries = {**consumers, **_consumers_of_dcf(node)}  # which was written before
    slot = next((sub for sub in slots if sub in entries and _is_free(entries, sub, master_id)), 0)
    word = watch_word(bus, node)
    own = ConsumerHeartbeatTime.parse(entries.get(slot) or 0).node_id == master_id
    if slot and (word or own):
        requested = is_requested(bus, node, WATCH_KEY)
        yield BootWrite(index, slot, encode(DataType.UNSIGNED32, word), WATCH_KEY, requested)


def _error_control(bus: BusConfig, node: NodeConfig) -> Iterator[BootWrite]:
    """Set the heartbeat of the device, and node guarding (CiA 301, 7.2.8)."""
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
    """Yield the mapped objects, and then their number."""
    index, count = pdo.mapping_index, len(pdo.mapping)
    for subindex, mapped in enumerate(pdo.mapping, start=1):
        data = encode(DataType.UNSIGNED32, mapped.word)
        yield BootWrite(index, subindex, data, key, requested, fixed=fixed)
    if count:
        yield BootWrite(index, 0, encode(DataType.UNSIGNED8, count), key, requested, fixed=fixed)


def _is_given(bus: BusConfig, node: NodeConfig, pdo: PdoConfig, key: str) -> bool:
    """Return whether bus.yml gives a key of a PDO, or a DCF the object."""
    if is_requested(bus, node, pdo.direction.name, str(pdo.number), key):
        return True
    if key == TIMER_KEY:  # which a DCF may leave to its default beside other parameters
        entry = node.dictionary.get(pdo.communication, EVENT_TIMER_SUBINDEX)
        return entry is not None and entry.configured
    index = pdo.mapping_index if key == 'mapping' else pdo.communication
    return node.dictionary.is_configured(index)


def _consumers_of_dcf(node: NodeConfig) -> dict[int, int]:
    """Return the entries of 0x1016 that are written from a DCF, before that for the master."""
    return {
        write.subindex: int.from_bytes(write.data, 'little')
        for write in node.parameter_writes
        if write.index == Index.CONSUMER_HEARTBEAT
    }


def assumed_cob_ids(node: NodeConfig) -> Iterator[BootWrite]:
    """Yield the COB-IDs that the device should have by its node id, though not by its EDS."""
    for pdo in node.pdos:
        if pdo.assumed and pdo.enabled and not pdo.configured:
            data = encode(DataType.UNSIGNED32, pdo.cob_id)
            yield BootWrite(pdo.communication, 1, data, pdo.key, mask=COB_ID_BITS, fixed=True)


def _written(write: SdoWrite, *, unless_default: bool = False) -> Iterator[BootWrite]:
    """Yield a write of a file; before a COB-ID one that ends its service, which fixes it."""
    address, place = (write.index, write.subindex), write.place
    key = f'{place.key} (line {place.line})' if place.line else place.key or 'bus.yml'
    value = int.from_bytes(write.data, 'little')
    mask, off = SERVICES_OFF.get(address, (0, 0))
    if value & mask != off:
        off |= value & ~mask
        ended = encode(DataType.UNSIGNED32, off)
        yield BootWrite(*address, ended, key, mask=mask, temporary=True)
        unless_default = False  # or an exported DCF would leave it ended
    yield BootWrite(*address, write.data, key, unless_default=unless_default)


def _units(time: float | None, per_second: float = HUNDRED_MICROSECONDS) -> int | None:
    return None if time is None else round(time * per_second)
