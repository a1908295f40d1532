# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The object dictionary of a bus's master for Lely, in the layout of dcfgen.

The master mirrors the PDOs of all devices: the n-th TPDO is RPDO n of the master with values in
0x2000 + n - 1, the n-th RPDO is TPDO n with values from 0x2200 + n - 1. Objects 0x5800 to 0x5FFF
map each value to the object of its device (Lely's remote PDO mapping).
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import TypeAlias

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
    object_address,
    ObjectCode,
    PDO_COUNT_MAX,
    SYNC_PRODUCER,
    TIME_PRODUCER,
)

Keys: TypeAlias = dict[str, str]
DcfObject: TypeAlias = dict[str, Keys]
"""The sections of an object, by the suffix after its index in the title."""


def _keys(
    name: str,
    data_type: DataType,
    access: AccessType,
    default: str = '',
    *,
    mappable: bool = False,
    upload_file: str = '',
) -> Keys:
    """Return the keys of a VAR or sub-index; an empty default or file is omitted."""
    keys = {
        'ParameterName': name,
        'ObjectType': f'0x{ObjectCode.VAR:X}',
        'DataType': f'0x{data_type:04X}',
        'AccessType': access.value,
        'DefaultValue': default,
        'PDOMapping': str(int(mappable)),
        'UploadFile': upload_file,
    }
    return {key: value for key, value in keys.items() if value or key == 'ParameterName'}


def _var(
    name: str,
    data_type: DataType,
    access: AccessType,
    default: str = '',
    *,
    mappable: bool = False,
) -> DcfObject:
    return {'': _keys(name, data_type, access, default, mappable=mappable)}


def _record(name: str, parts: Sequence[Keys], code: ObjectCode = ObjectCode.RECORD) -> DcfObject:
    """Return a record or array with parts from sub-index 1; sub-index 0 is added."""
    count = _keys('Highest sub-index supported', U8, AccessType.CONSTANT, str(len(parts)))
    head = {
        'ParameterName': name,
        'ObjectType': f'0x{code:X}',
        'SubNumber': str(len(parts) + 1),
    }
    return {'': head} | {f'sub{sub:X}': part for sub, part in enumerate((count, *parts))}


def _array(
    name: str,
    data_type: DataType,
    access: AccessType,
    size: int,
    values: Mapping[int, str] = MappingProxyType({}),
    *,
    default: str = '',
) -> DcfObject:
    """Return an array of equal sub-indices with CompactSubObj (CiA 306-1, 4.6.3.2).

    values has, by sub-index, those that differ from the default.
    """
    keys = _keys(name, data_type, access, default) | {
        'ObjectType': f'0x{ObjectCode.ARRAY:X}',
        'CompactSubObj': str(size),
    }
    if not values:
        return {'': keys}
    listed = {str(subindex): value for subindex, value in sorted(values.items())}
    return {'': keys, 'Value': {'NrOfEntries': str(len(values))} | listed}


def _numbers(name: str, words: Sequence[int], size: int = 0) -> DcfObject:
    """Return an array that starts with these numbers; size may be larger."""
    values = {sub: f'0x{word:08X}' for sub, word in enumerate(words, start=1)}
    return _array(name, U32, RW, size or len(words), values)


def _text(head: Mapping[str, Keys], objects: Mapping[int, DcfObject]) -> str:
    """Return the text of a DCF: head sections, object lists, and objects."""
    sections = dict(head)
    for title in LISTS:
        indices = sorted(index for index in objects if _list_of(index) == title)
        sections[title] = {'SupportedObjects': str(len(indices))} | {
            str(number): f'0x{index:04X}' for number, index in enumerate(indices, start=1)
        }
    for index, parts in sorted(objects.items()):
        sections |= {f'{index:04X}{suffix}': keys for suffix, keys in parts.items()}
    return '\n'.join(
        line
        for title, keys in sections.items()
        for line in (f'[{title}]', *(f'{key}={value}' for key, value in keys.items()), '')
    )


def _list_of(index: int) -> str:
    """Return the title of the list that contains an object (CiA 306-1, 4.6.2)."""
    if index in (Index.DEVICE_TYPE, Index.ERROR_REGISTER, Index.IDENTITY):
        return LISTS[0]
    return LISTS[2 if 0x2000 <= index < 0x6000 else 1]


LISTS = ('MandatoryObjects', 'OptionalObjects', 'ManufacturerObjects')
U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
RO, RW, WO = AccessType.READ_ONLY, AccessType.READ_WRITE, AccessType.WRITE_ONLY
DUMMY_TYPES = (*range(0x01, 0x08), 0x10, *range(0x12, 0x17), *range(0x18, 0x1C))
"""Integer types that may fill gaps in a PDO."""


SIDES: dict[str, tuple[Direction, int, int, int, AccessType]] = {
    TPDO.name: (RPDO, 0x2000, 0x5800, 0x5A00, AccessType.READ_WRITE_RPDO),
    RPDO.name: (TPDO, 0x2200, 0x5C00, 0x5E00, AccessType.READ_WRITE_TPDO),
}
"""By the device's direction: the master's direction, the first objects of the values, of the
device's node id with PDO number, and of the device's mapping; and the access type."""


def master_dcf(config: BusConfig, upload_files: Mapping[int, str]) -> str:
    """Return the master's DCF; upload_files are paths of the devices' concise DCFs by node id.

    Raises:
        CodecError: The devices have more PDOs of one direction than the master can have.
    """
    objects: dict[int, DcfObject] = {
        **dict(_communication(config)),
        **dict(network_objects(config, upload_files)),
    }
    counts = {}
    for direction in (TPDO, RPDO):
        pdos = [
            (node, pdo)
            for node in config.nodes
            for pdo in node.pdos
            if pdo.direction is direction and pdo.enabled and pdo.mapping
        ]
        if len(pdos) > PDO_COUNT_MAX:
            raise CodecError(
                f'{len(pdos)} {direction.title}s of the devices; a master has {PDO_COUNT_MAX}'
            )
        counts[direction.name] = len(pdos)
        objects |= dict(_mirrored(direction, pdos))
    return _text(_head(config.master, counts[TPDO.name], counts[RPDO.name]), objects)


def _head(master: MasterConfig, rpdos: int, tpdos: int) -> dict[str, dict[str, str]]:
    identity, rate = master.identity, round(master.bitrate * KILOBIT)
    # without 100, which only CiA 305 has: dcf-tools rejects it
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
        'DeviceComissioning': {  # misspelled in the standard
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
    yield Index.DEVICE_TYPE, _var('Device type', U32, RO, '0x00000000')
    yield Index.ERROR_REGISTER, _var('Error register', U8, RO)
    yield Index.PREDEFINED_ERROR_FIELD, _array('Pre-defined error field', U32, RO, 254)
    sync = f'0x{SYNC_PRODUCER | CobId.SYNC:08X}'
    yield Index.SYNC_COB_ID, _var('COB-ID SYNC', U32, RW, sync)
    period, window = (round(t * MICROSECONDS) for t in (master.sync_period, master.sync_window))
    yield Index.CYCLE_PERIOD, _var('Communication cycle period', U32, RW, str(period))
    yield Index.SYNC_WINDOW, _var('Synchronous window length', U32, RW, str(window))
    cob_id = f'0x{master.time_cob_id | TIME_PRODUCER * (master.time_period > 0):08X}'
    yield Index.TIME_COB_ID, _var('COB-ID TIME', U32, RW, cob_id)
    yield 0x1013, _var('High resolution time stamp', U32, RW, mappable=True)
    yield Index.EMCY_COB_ID, _var('COB-ID EMCY', U32, RW, '$NODEID+0x80')
    inhibit = str(round(master.emcy_inhibit_time * HUNDRED_MICROSECONDS))
    yield Index.EMCY_INHIBIT_TIME, _var('Inhibit time EMCY', U16, RW, inhibit)
    watched = [
        ConsumerHeartbeatTime(node.node_id, min(round(timeout * MILLISECONDS), U16_MAX))
        for node in config.nodes
        if (timeout := node.heartbeat_timeout) > 0
    ]
    if watched:
        words = [entry.word for entry in watched]
        yield Index.CONSUMER_HEARTBEAT, _numbers('Consumer heartbeat time', words, 127)
    heartbeat = str(round(master.heartbeat_producer * MILLISECONDS))
    yield Index.PRODUCER_HEARTBEAT, _var('Producer heartbeat time', U16, RW, heartbeat)
    identity = (
        ('Vendor-ID', master.identity.vendor_id),
        ('Product code', master.identity.product_code),
        ('Revision number', master.identity.revision_number),
        ('Serial number', master.identity.serial_number),
    )
    parts = [_keys(name, U32, RO, f'0x{value:08X}') for name, value in identity]
    yield Index.IDENTITY, _record('Identity object', parts)
    overflow = str(master.sync_overflow)
    yield Index.SYNC_OVERFLOW, _var('Synchronous counter overflow value', U8, RW, overflow)
    emergencies = {
        node.node_id: f'0x{node.emergency_id:08X}'
        for node in config.nodes
        if node.emergency_id is not None
    }
    none = f'0x{COB_ID_INVALID:08X}'
    yield 0x1028, _array('Emergency consumer object', U32, RW, 127, emergencies, default=none)
    behaviour = {sub: f'0x{value:02X}' for sub, value in ({1: 0} | master.error_behavior).items()}
    yield Index.ERROR_BEHAVIOUR, _array('Error behavior object', U8, RW, 254, behaviour)
    inhibit = str(round(master.nmt_inhibit_time * HUNDRED_MICROSECONDS))
    yield 0x102A, _var('NMT inhibit time', U16, RW, inhibit)


def _mirrored(
    direction: Direction, pdos: Iterable[tuple[NodeConfig, PdoConfig]]
) -> Iterator[tuple[int, DcfObject]]:
    """Yield the master's objects for all devices' PDOs of one direction."""
    own, first_values, first_number, first_mapping, access = SIDES[direction.name]
    places: dict[tuple[int, int, int], int] = {}  # node id, object -> mapping entry
    remote = f'Remote {direction.title}'
    for position, (node, pdo) in enumerate(pdos):
        values: list[Keys] = []
        words = []
        for mapped in pdo.mapping:
            address = node.node_id, mapped.index, mapped.subindex
            if address not in places:  # one entry for an object in two PDOs
                entry = node.dictionary.get(mapped.index, mapped.subindex)
                name = entry.name if entry is not None else object_address(*address[1:])
                name = f'{node.name}: {name}'
                values.append(_keys(name, mapped.data_type, access, mappable=True))
                place = (first_values + position) << 16 | len(values) << 8 | mapped.bits
                places[address] = place
            words.append(places[address])
        yield own.communication + position, _communication_parameter(own, pdo)
        yield own.mapping + position, _numbers(f'{own.title} mapping parameter', words)
        if values:
            name = f'Mapped application objects for {own.title} {position + 1}'
            yield first_values + position, _record(name, values)
        whose = f'0x{pdo.number << 8 | node.node_id:08X}'
        yield first_number + position, _var(f'{remote} number and node-ID', U32, RW, whose)
        words = [mapped.word for mapped in pdo.mapping]
        yield first_mapping + position, _numbers(f'{remote} mapping parameter', words)


def _communication_parameter(own: Direction, pdo: PdoConfig) -> DcfObject:
    """Return the master's communication parameter record for a device's PDO."""
    sends = own is TPDO
    inhibit = round((pdo.inhibit_time or 0.0) * HUNDRED_MICROSECONDS) if sends else 0
    parts = [
        _keys(f'COB-ID used by {own.title}', U32, RW, f'0x{pdo.cob_id:08X}'),
        _keys('Transmission type', U8, RW, f'0x{pdo.transmission:02X}'),
        _keys('Inhibit time', U16, RW, str(inhibit)),
        _keys('Reserved', U8, RW, '0'),
        _keys('Event timer', U16, RW, '0'),
    ]
    if sends:
        parts.append(_keys('SYNC start value', U8, RW, str(pdo.sync_start or 0)))
    return _record(f'{own.title} communication parameter', parts)


NODES = 127

IS_MASTER, START_ALL, NO_OWN_START = 0x01, 0x02, 0x04
NO_START, RESET_ALL, STOP_ALL = 0x08, 0x10, 0x40  # bits of 0x1F80, NMT start-up (CiA 302-2, 7.2)
IS_SLAVE, BOOT, MANDATORY, KEEP_ALIVE, RESTORE = 0x01, 0x04, 0x08, 0x10, 0x80
"""Bits of 0x1F81, slave assignment (CiA 302-2, 7.3); bits 8 to 15 are the retry factor, 16 to 31
the guard time."""


def network_objects(
    config: BusConfig, upload_files: Mapping[int, str]
) -> Iterator[tuple[int, DcfObject]]:
    """Yield the CiA 302 objects; upload_files are paths of concise DCFs by node id."""
    nodes = config.nodes
    if upload_files:
        yield 0x1F22, _files('Concise DCF', upload_files)
    yield 0x1F25, _array('Configuration request', U8, WO, NODES)
    yield 0x1F55, _array('Expected software identification', U32, RW, NODES)
    yield 0x1F80, _var('NMT start-up', U32, RW, f'0x{_start_up(config.master):08X}')
    assignment = {node.node_id: f'0x{_assignment(node):08X}' for node in nodes}
    yield 0x1F81, _array('NMT slave assignment', U32, RW, NODES, assignment)
    yield 0x1F82, _array('Request NMT', U8, RW, NODES)
    for index, name, attribute in (
        (0x1F84, 'Device type identification', 'device_type'),
        (0x1F85, 'Vendor identification', 'vendor_id'),
        (0x1F86, 'Product code', 'product_code'),
    ):
        values = {node.node_id: getattr(node.identity, attribute) for node in nodes}
        texts = {node_id: f'0x{value:08X}' for node_id, value in values.items() if value}
        yield index, _array(name, U32, RW, NODES, texts)
    # their values are in master.bin
    yield 0x1F87, _array('Revision number', U32, RW, NODES)
    yield 0x1F88, _array('Serial number', U32, RW, NODES)
    boot_time = str(round(config.master.boot_time * MILLISECONDS))
    yield 0x1F89, _var('Boot time', U32, RW, boot_time)
    restored = {
        node.node_id: f'0x{node.restore_configuration:02X}'
        for node in nodes
        if node.restore_configuration
    }
    yield 0x1F8A, _array('Restore configuration', U8, RW, NODES, restored)


def _files(name: str, paths: Mapping[int, str]) -> DcfObject:
    parts = [
        _keys(f'Node-ID {node_id}', DataType.DOMAIN, RO, upload_file=paths.get(node_id, ''))
        for node_id in range(1, NODES + 1)
    ]
    return _record(name, parts, ObjectCode.ARRAY)


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
