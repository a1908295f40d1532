# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reading the objects that are written at boot: the list ``sdo`` and ``error_behavior``."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from ...exceptions import CodecError
from ...standard.cob_id import CAN_ID_MASK, COB_ID_INVALID, CobId
from ...standard.datatypes import (
    DataType,
    encode,
    FIXED_BITS,
    integer_range,
    REAL_FORMATS,
    SIGNED_BITS,
    Value,
)
from ...standard.dictionary import object_address, ObjectDictionary, ObjectEntry
from ...standard.objects import Index, PDO_COUNT_MAX
from ..findings import Findings, Place, RefusedError
from ..model.bus import SdoWrite, SourceLocation
from ..read import scalars
from ..read.device_keys import SDO_KEYS
from ..read.document import Item, Scalar, ScalarKind, YamlMap
from ..read.schema import Key
from ..read.section import block, listing, read_section
from ..read.shared_keys import U8_MAX

PDO_OBJECTS = (
    (Index.RPDO_COMMUNICATION, 'rpdo'),
    (Index.RPDO_MAPPING, 'rpdo'),
    (Index.TPDO_COMMUNICATION, 'tpdo'),
    (Index.TPDO_MAPPING, 'tpdo'),
)
OWN_KEYS: dict[tuple[int, int], str] = {
    (Index.PRODUCER_HEARTBEAT, 0): 'heartbeat_producer',
    (Index.CONSUMER_HEARTBEAT, 1): 'heartbeat_consumer',
}
"""Objects that the master writes, with the key of their value."""


class SdoReader:
    """Reads what a device's section wants written at boot."""

    def __init__(self, dictionary: ObjectDictionary, findings: Findings) -> None:
        self._dictionary = dictionary
        self._findings = findings

    def read(self, device: YamlMap) -> tuple[SdoWrite, ...]:
        """Return the writes of a section (defaults merged) in their order."""
        writes = [
            *self._time_cob_id(device),
            *self._error_behaviour(device),
            *self._sdo_list(device),
        ]
        return tuple(write for write in writes if write is not None)

    def _time_cob_id(self, device: YamlMap) -> Iterator[SdoWrite | None]:
        item = device.entries.get('time_cob_id')
        if item is not None:
            yield self._write((Index.TIME_COB_ID, 0), item, item.place)

    def _error_behaviour(self, device: YamlMap) -> Iterator[SdoWrite | None]:
        section = block(device, 'error_behavior', self._findings)
        for name, item in section.entries.items() if section else ():
            subindex = scalars.key_number(name, U8_MAX)
            if subindex is None:
                self._findings.error(
                    item.place, f'{name!r} is no sub-index', "write '1: 0' and the like"
                )
            else:
                yield self._write((Index.ERROR_BEHAVIOUR, subindex), item, item.place)

    def _sdo_list(self, device: YamlMap) -> Iterator[SdoWrite | None]:
        entries = listing(device, 'sdo', self._findings)
        for item in entries.items if entries else ():
            values = read_object(item, SDO_KEYS, self._findings)
            if values is not None and isinstance(item, YamlMap):
                zero = Scalar(item.place, '0', ScalarKind.INTEGER)
                value = item.entries.get('value', zero)
                address = values['index'], values['subindex']
                yield self._write(address, value, item.place, values.get('timeout'))

    def _write(
        self,
        address: tuple[int, int],
        value: Item,
        place: Place,
        timeout: float | None = None,
    ) -> SdoWrite | None:
        try:
            entry = _writable_entry(self._dictionary, *address)
        except RefusedError as reason:
            self._findings.refuse(place, reason)
            return None
        try:
            data = encode_value(entry, value)
            _check_emergency(entry, data)
        except RefusedError as reason:
            self._findings.refuse(value.place, reason)
            return None
        return SdoWrite(*address, data, timeout, SourceLocation(place.line, place.key))


def read_object(item: Item, keys: tuple[Key, ...], findings: Findings) -> dict[str, Any] | None:
    """Read ``{index, sub_index}`` and more of an entry of ``sdo`` or ``mapping``.

    Returns:
        The values by field, None when the findings have the reason.
    """
    example = '{index: 0x6081, sub_index: 0}'
    if not isinstance(item, YamlMap):
        findings.error(
            item.place, f'expected an object, got {scalars.describe(item)}', f'write {example}'
        )
        return None
    values = read_section(item, keys, findings)
    if 'index' not in item.entries:
        findings.error(item.place, "no 'index'", f'write {example}')
    return values if 'index' in values else None


def _writable_entry(dictionary: ObjectDictionary, index: int, subindex: int) -> ObjectEntry:
    _check_purpose(index, subindex)
    entry = find_entry(dictionary, index, subindex)
    if entry.access.writable:
        return entry
    raise RefusedError(
        f'{entry} is read-only ({entry.access.value}) in the EDS', 'remove the entry'
    )


def _check_purpose(index: int, subindex: int) -> None:
    """Refuse objects that the master writes itself; a second writer would contradict it."""
    for first, name in PDO_OBJECTS:
        if first <= index < first + PDO_COUNT_MAX:
            raise RefusedError(
                f'{object_address(index)} configures a PDO, and the master would not know of it',
                f'set it below {name}: {index - first + 1}:',
            )
    if key := OWN_KEYS.get((index, subindex)):
        raise RefusedError(
            f'{object_address(index)} is written by the master, which has to know it',
            f'set {key} instead',
        )


def _check_emergency(entry: ObjectEntry, data: bytes) -> None:
    """Refuse EMCYs under an identifier that has another meaning for every device."""
    if entry.index == Index.EMCY_COB_ID and not int.from_bytes(data, 'little') & COB_ID_INVALID:
        cob_id = int.from_bytes(data, 'little') & CAN_ID_MASK
        if cob_id in (CobId.NMT, CobId.SYNC, CobId.TIME):
            raise RefusedError(
                f'0x{cob_id:03X} is the identifier of {CobId(cob_id).name}, and not for EMCYs',
                'write 0x80 plus the node id, or remove the entry',
            )


def find_entry(dictionary: ObjectDictionary, index: int, subindex: int) -> ObjectEntry:
    """Return an object of a device.

    Raises:
        RefusedError: The device does not have it; the remedy names the sub-indices that it has.
    """
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
    """Encode a value as an object holds it.

    Raises:
        RefusedError: It is of another kind, or beyond the limits of the type or the EDS.
    """
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
        return scalars.boolean(item)
    if data_type in REAL_FORMATS:
        return scalars.number(item)
    if integer_range(data_type) is not None:
        return scalars.integer(item)
    if data_type in (DataType.VISIBLE_STRING, DataType.UNICODE_STRING):
        return scalars.text(item)
    return _hexadecimal(item)


def _hexadecimal(item: Item) -> bytes:
    digits = scalars.text(item)
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
