# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Values of objects as a person reads them: states, modes, errors and COB-IDs in words."""

from __future__ import annotations

from collections.abc import Callable

from canopen_core import CodecError
from canopen_core.standard import (
    CAN_ID_MASK,
    COB_ID_INVALID,
    ConsumerHeartbeatTime,
    Controlword,
    DataType,
    decode,
    drive_state,
    error_code_text,
    error_register_text,
    Index,
    mapped_place,
    mode_title,
    object_address,
    pdo_object,
    sdo,
    Value,
)

CONTROLWORD_COMMANDS: tuple[tuple[int, int, str], ...] = (
    (0x80, 0x80, 'Fault reset'),
    (0x02, 0x00, 'Disable voltage'),
    (0x06, 0x02, 'Quick stop'),
    (0x07, 0x06, 'Shutdown'),
    (0x0F, 0x07, 'Switch on'),
    (0x0F, 0x0F, 'Enable operation'),
)
"""Mask, value and command; the first that fits counts (CiA 402-2, table 26)."""

_SIGNED_TYPES = {1: DataType.INTEGER8, 2: DataType.INTEGER16, 4: DataType.INTEGER32}
_UNSIGNED_TYPES = {1: DataType.UNSIGNED8, 2: DataType.UNSIGNED16, 4: DataType.UNSIGNED32}
_SIGNED_OBJECTS = frozenset(
    {
        Index.QUICK_STOP_OPTION,
        Index.MODE_OF_OPERATION,
        Index.MODE_OF_OPERATION_DISPLAY,
        Index.POSITION_DEMAND,
        Index.POSITION_ACTUAL,
        Index.VELOCITY_DEMAND,
        Index.VELOCITY_ACTUAL,
        Index.TARGET_TORQUE,
        Index.TORQUE_ACTUAL,
        Index.TARGET_POSITION,
        Index.HOME_OFFSET,
        Index.SOFTWARE_POSITION_LIMIT,
        Index.HOMING_METHOD,
        Index.INTERPOLATION_DATA,
        Index.FOLLOWING_ERROR,
        Index.TARGET_VELOCITY,
    }
)
"""Objects that are signed, for when there is no EDS (CiA 402-2)."""

_COB_ID_SUBINDEX = 1  # of a PDO communication parameter (CiA 301, 7.5.2.35)


def controlword_text(word: int) -> str:
    """Return a controlword in words: its command, halt, and the bits that depend on the mode."""
    command = next(
        (text for mask, value, text in CONTROLWORD_COMMANDS if word & mask == value), ''
    )
    extra = [f'bit {bit}' for bit in (4, 5, 6, 9) if word >> bit & 1]
    if word & Controlword.HALT:
        extra.append('halt')
    return ', '.join([f'0x{word:04X} {command}'.rstrip(), *extra])


def _cob_id_text(cob_id: int) -> str:
    disabled = ' disabled' if cob_id & COB_ID_INVALID else ''
    return f'0x{cob_id & CAN_ID_MASK:03X}{disabled}'


def _mapping_text(word: int) -> str:
    index, subindex, bits = mapped_place(word)
    return f'{object_address(index, subindex)} ({bits} bit)'


def _mode_text(number: int) -> str:
    return f'{number} {mode_title(number)}'


def _hex_text(number: int) -> str:
    return f'0x{number:08X}'


def _consumer_text(word: int) -> str:
    entry = ConsumerHeartbeatTime.parse(word)
    return f'node {entry.node_id}, {entry.time_ms} ms'


_TEXTS: dict[int, Callable[[int], str]] = {
    Index.CONTROLWORD: controlword_text,
    Index.STATUSWORD: lambda word: f'0x{word:04X} {drive_state(word).title}',
    Index.MODE_OF_OPERATION: _mode_text,
    Index.MODE_OF_OPERATION_DISPLAY: _mode_text,
    Index.ERROR_CODE: error_code_text,
    Index.ERROR_REGISTER: lambda bits: f'0x{bits:02X} {error_register_text(bits)}',
    Index.DEVICE_TYPE: _hex_text,
    Index.SYNC_COB_ID: _cob_id_text,
    Index.EMCY_COB_ID: _cob_id_text,
}
_RECORD_TEXTS: dict[int, Callable[[int], str]] = {
    Index.PREDEFINED_ERROR_FIELD: lambda code: error_code_text(code & 0xFFFF),
    Index.IDENTITY: _hex_text,
    Index.CONSUMER_HEARTBEAT: _consumer_text,
}
"""The same for sub-indices from 1."""


def value_text(index: int, subindex: int, value: Value) -> str:
    """Write a decoded value as a person reads it."""
    if isinstance(value, bytes):
        return value.hex(' ') or 'nothing'
    if isinstance(value, str):
        # escape what would break the line or steer the terminal; devices may send anything
        text = value.rstrip(chr(0))
        shown = (c if c.isprintable() else c.encode('unicode_escape').decode() for c in text)
        return f'"{"".join(shown)}"'
    if isinstance(value, float):
        return f'{value:.7g}'
    words = _text_of(index, subindex)
    return words(value) if words else str(value)


def _text_of(index: int, subindex: int) -> Callable[[int], str] | None:
    pdo = pdo_object(index)
    if pdo is not None and not pdo.is_mapping:
        return _cob_id_text if subindex == _COB_ID_SUBINDEX else None
    if not subindex:
        return _TEXTS.get(index)
    return _RECORD_TEXTS.get(index) if pdo is None else _mapping_text


def data_text(index: int, subindex: int, data_type: DataType | None, data: bytes) -> str:
    """Write the bytes of an SDO as a person reads them; expedited ones may exceed their type.

    The type by the EDS is None when it is unknown.
    """
    if data_type is None:
        likely = _SIGNED_TYPES if index in _SIGNED_OBJECTS else _UNSIGNED_TYPES
        data_type = likely.get(len(data))
    if data_type is None:
        return data.hex(' ') or 'nothing'
    try:
        value = decode(data_type, sdo.fitted(data_type, data))
    except CodecError as error:
        return f'{data.hex(" ")} ({error})'
    return value_text(index, subindex, value)
