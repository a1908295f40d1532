# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The object dictionary of a master for a bus, as dcfgen lays it out, so that Lely can run it.

What the devices send is mirrored: the n-th TPDO of all devices is RPDO n of the master and ends
up in 0x2000 + n - 1, the n-th RPDO is TPDO n and comes from 0x2200 + n - 1. The objects 0x5800 to
0x5FFF hold which object of which device each is (Lely's remote PDO mapping).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from arm_canopen.config import (
    BusConfig,
    Direction,
    HUNDRED_MICROSECONDS,
    KILOBIT,
    MasterConfig,
    MICROSECONDS,
    MILLISECONDS,
    NodeConfig,
    PdoConfig,
    RPDO,
    TPDO,
    U16_MAX,
)
from canopen_core import CodecError
from canopen_core.standard import (
    AccessType,
    BIT_RATES_KBIT,
    COB_ID_INVALID,
    CobId,
    ConsumerHeartbeatTime,
    DataType,
    Index,
    MappedObject,
    object_address,
    ObjectCode,
    PDO_COUNT_MAX,
    SYNC_PRODUCER,
    TIME_PRODUCER,
)

from .eds_lint import LISTS, proper_list


@dataclass(frozen=True, slots=True)
class DcfEntry:
    """A VAR, or a sub-index."""

    name: str
    data_type: DataType
    access: AccessType
    default: str = ''  # DefaultValue as it is written, empty for none
    mappable: bool = False  # may be mapped into a PDO
    upload_file: str = ''  # file whose content the object has, empty for none

    def lines(self) -> list[str]:
        """Return its keys."""
        return [
            f'ParameterName={self.name}',
            f'ObjectType=0x{ObjectCode.VAR:X}',
            f'DataType=0x{self.data_type:04X}',
            f'AccessType={self.access.value}',
            *([f'DefaultValue={self.default}'] if self.default else []),
            f'PDOMapping={int(self.mappable)}',
            *([f'UploadFile={self.upload_file}'] if self.upload_file else []),
        ]


@dataclass(frozen=True, slots=True)
class DcfRecord:
    """A record or array with each sub-index written out; sub-index 0 is added."""

    name: str
    parts: Sequence[DcfEntry]  # its sub-indices from 1
    code: ObjectCode = ObjectCode.RECORD  # RECORD or ARRAY


@dataclass(frozen=True, slots=True)
class DcfArray:
    """An array of equal sub-indices, abbreviated with CompactSubObj (CiA 306-1, 4.6.3.2)."""

    name: str
    data_type: DataType
    access: AccessType
    size: int
    # values by sub-index where they are not the default
    values: Mapping[int, str] = field(default_factory=dict)
    default: str = ''  # DefaultValue of all others, empty for none


DcfObject = DcfEntry | DcfRecord | DcfArray


def dcf_text(head: Mapping[str, Mapping[str, str]], objects: Mapping[int, DcfObject]) -> str:
    """Return the text of a DCF: the sections before the objects, each with its keys, and these."""
    lines: list[str] = []
    for title, keys in head.items():
        lines += [f'[{title}]', *(f'{key}={value}' for key, value in keys.items()), '']
    for title in LISTS.values():
        lines += _list(title, sorted(i for i in objects if proper_list(i) == title))
    for index, content in sorted(objects.items()):
        lines += _object(index, content)
    return '\n'.join(lines)


def _list(title: str, indices: Iterable[int]) -> list[str]:
    entries = [f'{n}=0x{index:04X}' for n, index in enumerate(indices, start=1)]
    return [f'[{title}]', f'SupportedObjects={len(entries)}', *entries, '']


def _object(index: int, content: DcfObject) -> list[str]:
    if isinstance(content, DcfEntry):
        return [f'[{index:04X}]', *content.lines(), '']
    if isinstance(content, DcfArray):
        return _array(index, content)
    count = DcfEntry(
        'Highest sub-index supported',
        DataType.UNSIGNED8,
        AccessType.CONSTANT,
        str(len(content.parts)),
    )
    lines = [f'[{index:04X}]', f'ParameterName={content.name}', f'ObjectType=0x{content.code:X}']
    lines += [f'SubNumber={len(content.parts) + 1}', '']
    for subindex, part in enumerate((count, *content.parts)):
        lines += [f'[{index:04X}sub{subindex:X}]', *part.lines(), '']
    return lines


def _array(index: int, array: DcfArray) -> list[str]:
    lines = [
        f'[{index:04X}]',
        f'ParameterName={array.name}',
        f'ObjectType=0x{ObjectCode.ARRAY:X}',
        f'DataType=0x{array.data_type:04X}',
        f'AccessType={array.access.value}',
        *([f'DefaultValue={array.default}'] if array.default else []),
        'PDOMapping=0',
        f'CompactSubObj={array.size}',
        '',
    ]
    if array.values:
        lines += [f'[{index:04X}Value]', f'NrOfEntries={len(array.values)}']
        lines += [f'{subindex}={value}' for subindex, value in sorted(array.values.items())]
        lines += ['']
    return lines


U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
RO, RW, WO = AccessType.READ_ONLY, AccessType.READ_WRITE, AccessType.WRITE_ONLY
DUMMY_TYPES = (*range(0x01, 0x08), 0x10, *range(0x12, 0x17), *range(0x18, 0x1C))
"""Integer types, which a PDO may have as gaps."""


@dataclass(frozen=True, slots=True)
class Side:
    """What one direction of PDOs is called in the master's dictionary."""

    own: Direction  # the direction as the master sees it
    values: int  # first object with the values
    remote_number: int  # first object that holds whose PDO it is
    remote_mapping: int  # first object with the mapping of the device
    access: AccessType


SIDES: dict[str, Side] = {
    TPDO.name: Side(RPDO, 0x2000, 0x5800, 0x5A00, AccessType.READ_WRITE_RPDO),
    RPDO.name: Side(TPDO, 0x2200, 0x5C00, 0x5E00, AccessType.READ_WRITE_TPDO),
}
"""By the direction as the device sees it."""


def master_dcf(config: BusConfig, upload_files: Mapping[int, str]) -> str:
    """Return the DCF of the master, with the path of each device's concise DCF by node id.

    Raises:
        CodecError: The devices have more PDOs of one direction than the master can have.
    """
    objects: dict[int, DcfObject] = {
        **dict(_communication(config)),
        **dict(network_objects(config, upload_files)),
    }
    counts = {}
    for direction in (TPDO, RPDO):
        pdos = list(_pdos(config, direction))
        if len(pdos) > PDO_COUNT_MAX:
            raise CodecError(
                f'{len(pdos)} {direction.title}s of the devices; a master has {PDO_COUNT_MAX}'
            )
        counts[direction.name] = len(pdos)
        objects |= dict(_mirrored(direction, pdos))
    return dcf_text(_head(config.master, counts[TPDO.name], counts[RPDO.name]), objects)


def _head(master: MasterConfig, rpdos: int, tpdos: int) -> dict[str, dict[str, str]]:
    identity, rate = master.identity, round(master.bitrate * KILOBIT)
    # 100 is in CiA 305 alone: dcf-tools refuses a file that names it
    rates = [each for each in BIT_RATES_KBIT if each != 100 or rate == 100]
    return {
        'FileInfo': {
            'FileName': 'master.dcf',
            'FileVersion': '1',
            'FileRevision': '0',
            'EDSVersion': '4.0',
            'Description': 'CANopen master',
        },
        'DeviceInfo': {
            'VendorName': '',
            'VendorNumber': f'0x{identity.vendor_id:08X}',
            'ProductName': '',
            'ProductNumber': f'0x{identity.product_code:08X}',
            'RevisionNumber': f'0x{identity.revision_number:08X}',
            'OrderCode': '',
            **{f'BaudRate_{each}': '1' for each in rates},
            'SimpleBootUpMaster': '1',
            'SimpleBootUpSlave': '0',
            'Granularity': '1',
            'DynamicChannelsSupported': '0',
            'GroupMessaging': '0',
            'NrOfRXPDO': str(rpdos),
            'NrOfTXPDO': str(tpdos),
            'LSS_Supported': '1',
        },
        'DummyUsage': {f'Dummy{number:04X}': '1' for number in DUMMY_TYPES},
        'DeviceComissioning': {  # the standard misspells it
            'NodeID': str(master.node_id),
            'NodeName': '',
            'Baudrate': f'{master.bitrate * KILOBIT:g}',
            'NetNumber': '1',
            'NetworkName': '',
            'CANopenManager': '1',
            'LSS_SerialNumber': f'0x{identity.serial_number:08X}',
        },
    }


def _communication(config: BusConfig) -> Iterator[tuple[int, DcfObject]]:
    """Yield the communication profile of the master (CiA 301, 7.5.2), without its PDOs."""
    master = config.master
    yield Index.DEVICE_TYPE, DcfEntry('Device type', U32, RO, '0x00000000')
    yield Index.ERROR_REGISTER, DcfEntry('Error register', U8, RO)
    yield Index.PREDEFINED_ERROR_FIELD, DcfArray('Pre-defined error field', U32, RO, 254)
    sync = f'0x{SYNC_PRODUCER | CobId.SYNC:08X}'
    yield Index.SYNC_COB_ID, DcfEntry('COB-ID SYNC', U32, RW, sync)
    period, window = (round(t * MICROSECONDS) for t in (master.sync_period, master.sync_window))
    yield Index.CYCLE_PERIOD, DcfEntry('Communication cycle period', U32, RW, str(period))
    yield Index.SYNC_WINDOW, DcfEntry('Synchronous window length', U32, RW, str(window))
    cob_id = f'0x{master.time_cob_id | TIME_PRODUCER * (master.time_period > 0):08X}'
    yield Index.TIME_COB_ID, DcfEntry('COB-ID TIME', U32, RW, cob_id)
    yield 0x1013, DcfEntry('High resolution time stamp', U32, RW, mappable=True)
    yield Index.EMCY_COB_ID, DcfEntry('COB-ID EMCY', U32, RW, '$NODEID+0x80')
    inhibit = str(round(master.emcy_inhibit_time * HUNDRED_MICROSECONDS))
    yield Index.EMCY_INHIBIT_TIME, DcfEntry('Inhibit time EMCY', U16, RW, inhibit)
    watched = _watched(config.nodes)
    if watched:
        yield (
            Index.CONSUMER_HEARTBEAT,
            DcfArray('Consumer heartbeat time', U32, RW, 127, dict(enumerate(watched, start=1))),
        )
    heartbeat = str(round(master.heartbeat_producer * MILLISECONDS))
    yield Index.PRODUCER_HEARTBEAT, DcfEntry('Producer heartbeat time', U16, RW, heartbeat)
    yield Index.IDENTITY, _identity(master)
    overflow = str(master.sync_overflow)
    yield Index.SYNC_OVERFLOW, DcfEntry('Synchronous counter overflow value', U8, RW, overflow)
    emergencies = dict(_emergencies(config.nodes))
    none = f'0x{COB_ID_INVALID:08X}'
    yield 0x1028, DcfArray('Emergency consumer object', U32, RW, 127, emergencies, none)
    behaviour = {sub: f'0x{value:02X}' for sub, value in ({1: 0} | master.error_behavior).items()}
    yield Index.ERROR_BEHAVIOUR, DcfArray('Error behavior object', U8, RW, 254, behaviour)
    inhibit = str(round(master.nmt_inhibit_time * HUNDRED_MICROSECONDS))
    yield 0x102A, DcfEntry('NMT inhibit time', U16, RW, inhibit)


def _identity(master: MasterConfig) -> DcfRecord:
    identity = master.identity
    return DcfRecord(
        'Identity object',
        [
            DcfEntry(name, U32, RO, f'0x{value:08X}')
            for name, value in (
                ('Vendor-ID', identity.vendor_id),
                ('Product code', identity.product_code),
                ('Revision number', identity.revision_number),
                ('Serial number', identity.serial_number),
            )
        ],
    )


def _watched(nodes: Iterable[NodeConfig]) -> list[str]:
    """Return the entries of 0x1016: node id and consumer time in [ms]."""
    return [
        f'0x{ConsumerHeartbeatTime(node.node_id, _milliseconds(node.heartbeat_timeout)).word:08X}'
        for node in nodes
        if node.heartbeat_timeout > 0
    ]


def _milliseconds(time: float) -> int:
    return min(round(time * MILLISECONDS), U16_MAX)


def _emergencies(nodes: Iterable[NodeConfig]) -> Iterator[tuple[int, str]]:
    for node in nodes:
        if node.emergency_id is not None:
            yield node.node_id, f'0x{node.emergency_id:08X}'


def _pdos(config: BusConfig, direction: Direction) -> Iterator[tuple[NodeConfig, PdoConfig]]:
    for node in config.nodes:
        for pdo in node.tpdos if direction is TPDO else node.rpdos:
            if pdo.enabled and pdo.mapping:
                yield node, pdo


def _mirrored(
    direction: Direction, pdos: Iterable[tuple[NodeConfig, PdoConfig]]
) -> Iterator[tuple[int, DcfObject]]:
    """Yield what the master has for the PDOs of one direction of all devices."""
    side = SIDES[direction.name]
    places: dict[tuple[int, int, int], str] = {}  # node id, object -> mapping entry
    for position, (node, pdo) in enumerate(pdos):
        values: list[DcfEntry] = []
        words = []
        for mapped in pdo.mapping:
            address = node.node_id, mapped.index, mapped.subindex
            if address not in places:  # an object that two PDOs carry has one place
                values.append(_value(node, mapped, side.access))
                place = (side.values + position) << 16 | len(values) << 8 | mapped.bits
                places[address] = f'0x{place:08X}'
            words.append(places[address])
        yield side.own.communication + position, _communication_parameter(side.own, pdo)
        yield side.own.mapping + position, _mapping(f'{side.own.title} mapping parameter', words)
        if values:
            name = f'Mapped application objects for {side.own.title} {position + 1}'
            yield side.values + position, DcfRecord(name, values)
        yield from _remote(direction, position, node, pdo)


def _value(node: NodeConfig, mapped: MappedObject, access: AccessType) -> DcfEntry:
    entry = node.dictionary.get(mapped.index, mapped.subindex)
    name = entry.name if entry is not None else object_address(mapped.index, mapped.subindex)
    return DcfEntry(f'{node.name}: {name}', mapped.data_type, access, mappable=True)


def _communication_parameter(own: Direction, pdo: PdoConfig) -> DcfRecord:
    """Return the record 0x1400 or 0x1800 of the master for a PDO of a device."""
    sends = own is TPDO
    inhibit = round((pdo.inhibit_time or 0.0) * HUNDRED_MICROSECONDS) if sends else 0
    parts = [
        DcfEntry(f'COB-ID used by {own.title}', U32, RW, f'0x{pdo.cob_id:08X}'),
        DcfEntry('Transmission type', U8, RW, f'0x{pdo.transmission:02X}'),
        DcfEntry('Inhibit time', U16, RW, str(inhibit)),
        DcfEntry('Reserved', U8, RW, '0'),
        DcfEntry('Event timer', U16, RW, '0'),
    ]
    if sends:
        parts.append(DcfEntry('SYNC start value', U8, RW, str(pdo.sync_start or 0)))
    return DcfRecord(f'{own.title} communication parameter', parts)


def _mapping(name: str, words: list[str]) -> DcfArray:
    return DcfArray(name, U32, RW, len(words), dict(enumerate(words, start=1)))


def _remote(
    direction: Direction, position: int, node: NodeConfig, pdo: PdoConfig
) -> Iterator[tuple[int, DcfObject]]:
    """Return which PDO of which device it is, and its mapping there."""
    side = SIDES[direction.name]
    whose = f'0x{pdo.number << 8 | node.node_id:08X}'
    title = f'Remote {direction.title}'
    yield side.remote_number + position, DcfEntry(f'{title} number and node-ID', U32, RW, whose)
    words = [f'0x{mapped.word:08X}' for mapped in pdo.mapping]
    yield side.remote_mapping + position, _mapping(f'{title} mapping parameter', words)


NODES = 127

IS_MASTER, START_ALL, NO_OWN_START = 0x01, 0x02, 0x04
NO_START, RESET_ALL, STOP_ALL = 0x08, 0x10, 0x40  # bits of 0x1F80, NMT start-up (CiA 302-2, 7.2)
IS_SLAVE, BOOT, MANDATORY, KEEP_ALIVE, RESTORE = 0x01, 0x04, 0x08, 0x10, 0x80
"""Bits of 0x1F81, slave assignment (CiA 302-2, 7.3); bits 8 to 15 are the retry factor, 16 to 31
the guard time."""


def network_objects(
    config: BusConfig, upload_files: Mapping[int, str]
) -> Iterator[tuple[int, DcfObject]]:
    """Yield the objects by index; upload_files has the paths of concise DCFs by node id."""
    nodes = config.nodes
    if upload_files:
        yield 0x1F22, _files('Concise DCF', upload_files)
    yield 0x1F25, DcfArray('Configuration request', U8, WO, NODES)
    yield 0x1F55, DcfArray('Expected software identification', U32, RW, NODES)
    yield 0x1F80, DcfEntry('NMT start-up', U32, RW, f'0x{_start_up(config.master):08X}')
    assignment = {node.node_id: f'0x{_assignment(node):08X}' for node in nodes}
    yield 0x1F81, DcfArray('NMT slave assignment', U32, RW, NODES, assignment)
    yield 0x1F82, DcfArray('Request NMT', U8, RW, NODES)
    for index, name, attribute in (
        (0x1F84, 'Device type identification', 'device_type'),
        (0x1F85, 'Vendor identification', 'vendor_id'),
        (0x1F86, 'Product code', 'product_code'),
    ):
        values = {node.node_id: getattr(node.identity, attribute) for node in nodes}
        texts = {node_id: f'0x{value:08X}' for node_id, value in values.items() if value}
        yield index, DcfArray(name, U32, RW, NODES, texts)
    # master.bin has the values of these two
    yield 0x1F87, DcfArray('Revision number', U32, RW, NODES)
    yield 0x1F88, DcfArray('Serial number', U32, RW, NODES)
    boot_time = str(round(config.master.boot_time * MILLISECONDS))
    yield 0x1F89, DcfEntry('Boot time', U32, RW, boot_time)
    restored = {
        node.node_id: f'0x{node.restore_configuration:02X}'
        for node in nodes
        if node.restore_configuration
    }
    yield 0x1F8A, DcfArray('Restore configuration', U8, RW, NODES, restored)


def _files(name: str, paths: Mapping[int, str]) -> DcfRecord:
    parts = [
        DcfEntry(f'Node-ID {node_id}', DataType.DOMAIN, RO, upload_file=paths.get(node_id, ''))
        for node_id in range(1, NODES + 1)
    ]
    return DcfRecord(name, parts, ObjectCode.ARRAY)


def _start_up(master: MasterConfig) -> int:
    return (
        IS_MASTER
        | START_ALL * master.start_all_nodes
        | NO_OWN_START * (not master.start)
        | NO_START * (not master.start_nodes)
        | RESET_ALL * master.reset_all_nodes
        | STOP_ALL * master.stop_all_nodes
    )


def _assignment(node: NodeConfig) -> int:
    return (
        IS_SLAVE
        | BOOT * node.boot
        | MANDATORY * node.mandatory
        | KEEP_ALIVE * (not node.reset_communication)
        | RESTORE * bool(node.restore_configuration)
        | node.retry_factor << 8
        | round(node.guard_time * MILLISECONDS) << 16
    )
