# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The objects written at boot: ``sdo``, ``error_behavior``, and the values of a DCF.

A DCF is an EDS with the values of one configured device. A configuration manager downloads
(CiA 302-3, 0x1F20) the ParameterValues that differ from the defaults (CiA 306-1, 4.6.3). Those of
PDO parameters go into the PDOs of the bus model.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from canopen_core import CodecError, Findings, Place, RefusedError
from canopen_core.eds import Eds
from canopen_core.standard import (
    axis_of,
    CAN_ID_MASK,
    COB_ID_INVALID,
    CobId,
    COMMANDS,
    DataType,
    encode,
    FIXED_BITS,
    Index,
    integer_range,
    is_drive,
    object_address,
    ObjectDictionary,
    ObjectEntry,
    pdo_object,
    REAL_FORMATS,
    SIGNED_BITS,
    Value,
)

from ..keys import Key
from ..model.boot_plan import ERROR_CONTROL
from ..model.bus import SdoWrite
from ..read.document import Item, Scalar, ScalarKind, YamlMap
from ..read.section import (
    block,
    boolean,
    describe,
    integer,
    key_number,
    listing,
    number,
    read_section,
    text,
)
from ..sections import SDO_KEYS, U8_MAX

OWN_KEYS: dict[tuple[int, int], str] = {
    (Index.PRODUCER_HEARTBEAT, 0): 'heartbeat_producer',
    (Index.CONSUMER_HEARTBEAT, 1): 'heartbeat_consumer',
}
"""Objects that the master writes, with the key of their value."""


def read_writes(
    device: YamlMap, dictionary: ObjectDictionary, findings: Findings
) -> tuple[SdoWrite, ...]:
    """Return the writes that a section (defaults merged) requests, in the order of writing."""
    writes = []
    for address, value, place, timeout in _wanted(device, findings):
        at = place
        try:
            entry = _writable(dictionary, *address)
            at = value.place
            data = encode_value(entry, value)
            _check_emergency(entry, data)
        except RefusedError as reason:
            findings.refuse(at, reason)
        else:
            writes.append(SdoWrite(*address, data, timeout, place))
    return tuple(writes)


def _wanted(
    device: YamlMap, findings: Findings
) -> Iterator[tuple[tuple[int, int], Item, Place, float | None]]:
    """Yield the address, value, place and time-out of each write."""
    item = device.entries.get('time_cob_id')
    if item is not None:
        yield (Index.TIME_COB_ID, 0), item, item.place, None
    for subindex, item in error_behaviours(device, findings):
        yield (Index.ERROR_BEHAVIOUR, subindex), item, item.place, None
    entries = listing(device, 'sdo', findings)
    for item in entries.items if entries else ():
        values = read_object(item, SDO_KEYS, findings)
        if values is not None and isinstance(item, YamlMap):
            value = item.entries.get('value', Scalar(item.place, '0', ScalarKind.INTEGER))
            address = values['index'], values['subindex']
            yield address, value, item.place, values.get('timeout')


def error_behaviours(section: YamlMap, findings: Findings) -> Iterator[tuple[int, Item]]:
    """Yield sub-index and value of 0x1029 from ``error_behavior`` (CiA 301, 7.5.2.28)."""
    given = block(section, 'error_behavior', findings)
    for name, item in given.entries.items() if given else ():
        subindex = key_number(name, U8_MAX)
        if subindex is None:
            findings.error(item.place, f'{name!r} is no sub-index', "write '1: 0' and the like")
        else:
            yield subindex, item


def read_object(item: Item, keys: tuple[Key, ...], findings: Findings) -> dict[str, Any] | None:
    """Return the values of an entry of ``sdo`` or ``mapping`` by field; None if it is invalid."""
    example = '{index: 0x6081, sub_index: 0}'
    if not isinstance(item, YamlMap):
        findings.error(item.place, f'expected an object, got {describe(item)}', f'write {example}')
        return None
    values = {'subindex': 0} | read_section(item, keys, findings)
    if 'index' not in item.entries:
        findings.error(item.place, "no 'index'", f'write {example}')
    return values if 'index' in values else None


def _writable(dictionary: ObjectDictionary, index: int, subindex: int) -> ObjectEntry:
    """Return an object that may be written; refuse read-only ones and those of the master."""
    if pdo := pdo_object(index):
        raise RefusedError(
            f'{object_address(index)} configures a PDO, and the master would not know of it',
            f'set it below {pdo.direction}: {pdo.number}:',
        )
    if key := OWN_KEYS.get((index, subindex)):
        raise RefusedError(
            f'{object_address(index)} is written by the master, which has to know it',
            f'set {key} instead',
        )
    entry = find_entry(dictionary, index, subindex)
    if not entry.access.writable:
        what = f'{entry} is read-only ({entry.access.value}) in the EDS'
        raise RefusedError(what, 'remove the entry')
    return entry


def _check_emergency(entry: ObjectEntry, data: bytes) -> None:
    """Refuse the COB-ID of NMT, SYNC or TIME for EMCYs."""
    if entry.index == Index.EMCY_COB_ID and not int.from_bytes(data, 'little') & COB_ID_INVALID:
        cob_id = int.from_bytes(data, 'little') & CAN_ID_MASK
        if cob_id in (CobId.NMT, CobId.SYNC, CobId.TIME):
            raise RefusedError(
                f'0x{cob_id:03X} is the identifier of {CobId(cob_id).name}, and not for EMCYs',
                'write 0x80 plus the node id, or remove the entry',
            )


def find_entry(dictionary: ObjectDictionary, index: int, subindex: int) -> ObjectEntry:
    """Return an object of a device; the error for a missing one lists the existing sub-indices."""
    entry = dictionary.get(index, subindex)
    if entry is not None:
        return entry
    others = ', '.join(str(other.subindex) for other in dictionary.subindices(index))
    hint = f'; its sub-indices are {others}' if others else ''
    raise RefusedError(
        f'object {object_address(index, subindex)} is not in the EDS {dictionary.source}',
        f'correct index and sub_index{hint}, or use the EDS that fits the device',
    )


def encode_value(entry: ObjectEntry, item: Item) -> bytes:
    """Encode a value for an object; refuse values beyond the limits of its type and the EDS."""
    value = _value(entry.data_type, item)
    try:
        data = encode(entry.data_type, value)
    except CodecError as error:
        raise RefusedError(f'{entry}: {error}', _range_remedy(entry.data_type, value)) from None
    low, high = entry.low_limit, entry.high_limit
    if isinstance(value, (int, float)) and (
        (low is not None and value < low) or (high is not None and value > high)
    ):
        limits = f'{"" if low is None else low} to {"" if high is None else high}'
        raise RefusedError(
            f'{entry}: {value} is beyond its limits in the EDS', f'take a value in {limits}'
        )
    return data


def _value(data_type: DataType, item: Item) -> Value:
    if data_type is DataType.BOOLEAN:
        return boolean(item)
    if data_type in REAL_FORMATS:
        return number(item)
    if integer_range(data_type) is not None:
        return integer(item)
    if data_type in (DataType.VISIBLE_STRING, DataType.UNICODE_STRING):
        return text(item)
    digits = text(item)
    try:
        return bytes.fromhex(digits)
    except ValueError:
        raise RefusedError(
            f'{digits[:40]!r} is no sequence of bytes', "write it as '0A 1B 2C'"
        ) from None


def _range_remedy(data_type: DataType, value: Value) -> str:
    limits = integer_range(data_type)
    if limits is None or not isinstance(value, int):
        return 'correct the value'
    bits = FIXED_BITS[data_type]
    if data_type in SIGNED_BITS and limits[1] < value < 1 << bits:
        return f'the type is signed: for these bits write {value - (1 << bits)}'
    return f'take {limits[0]} to {limits[1]}'


ACTIONS = frozenset({Index.STORE_PARAMETERS, Index.RESTORE_PARAMETERS})
"""Objects that do something when they are written."""
PROGRAMS_AND_NMT = range(0x1F50, 0x1FA0)  # CiA 302-2 and -3


def parameter_writes(eds: Eds, findings: Findings) -> tuple[SdoWrite, ...]:
    """Return the writes of a DCF in ascending order, except invalid ones; none for an EDS."""
    return tuple(
        SdoWrite(
            *entry.address, data, place=Place(eds.path, key=f'ParameterValue of {eds.path.name}')
        )
        for entry in eds.dictionary
        if entry.configured
        and _is_setting(entry)
        and (data := _data(entry, eds, findings)) is not None
    )


def _is_setting(entry: ObjectEntry) -> bool:
    index = entry.index
    others = index in ACTIONS or index in ERROR_CONTROL or index == Index.SDO_SERVER
    others = others or pdo_object(index) is not None or index in PROGRAMS_AND_NMT
    return entry.access.writable and not others


def _data(entry: ObjectEntry, eds: Eds, findings: Findings) -> bytes | None:
    place = Place(eds.path, entry.line, f'[{entry.index:04X}]')
    if is_drive(eds.dictionary) and axis_of(entry.index)[0] in COMMANDS:
        what = f'the ParameterValue of {entry} is a command, which is not written at boot'
        findings.warning(place, what, 'remove it; the drive gets its commands at run time')
        return None
    if entry.default is None:
        return None
    try:
        return encode(entry.data_type, entry.default)
    except CodecError as error:
        findings.warning(place, f'the ParameterValue of {entry}: {error}', 'correct it')
        return None
