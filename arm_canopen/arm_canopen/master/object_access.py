# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Objects as the raw 32 bits that ros2_canopen's messages carry."""

from __future__ import annotations

import struct

from canopen_core import CodecError
from canopen_core.standard import (
    byte_length,
    DataType,
    MappedObject,
    Number,
    PdoCodec,
    SIGNED_BITS,
)

RAW_BYTES = 4  # [byte] in COData, CORead and COWrite


def raw_from_bytes(data: bytes) -> int:
    """Return up to four bytes as they are, zero-extended.

    Raises:
        CodecError: There are more; the message has no room for them.
    """
    if len(data) > RAW_BYTES:
        raise CodecError(f'the object has {len(data)} bytes, more than the 4 of this message')
    return int.from_bytes(data, 'little')


def bytes_from_raw(data_type: DataType, raw: int) -> bytes:
    """Return the bytes of an object from the 32 bits of a message.

    A negative number may come zero-extended to its type or sign-extended to 32 bits.

    Raises:
        CodecError: The type does not fit into 32 bits, or the value does not fit the type.
    """
    size = byte_length(data_type)
    if size is None or size > RAW_BYTES:
        raise CodecError(f'{data_type.name} does not fit into the 32 bits of this message')
    bits = size * 8
    raw = _narrowed(data_type, bits, raw)
    if raw >> (1 if data_type is DataType.BOOLEAN else bits):
        raise CodecError(f'0x{raw:X} does not fit {data_type.name}')
    return raw.to_bytes(size, 'little')


def _narrowed(data_type: DataType, bits: int, raw: int) -> int:
    """Cut a negative number that was sign-extended to 32 bits down to those of its type."""
    negative = raw >> (bits - 1) == (1 << (33 - bits)) - 1 if bits <= 32 else False
    return raw & ((1 << bits) - 1) if negative and data_type in SIGNED_BITS else raw


def raw_from_number(mapped: MappedObject, value: Number) -> int:
    """Return a value of a PDO as the 32 bits of a message, cut off if it has more."""
    return int.from_bytes(PdoCodec([mapped]).pack([value])[:RAW_BYTES], 'little')


def number_from_raw(mapped: MappedObject, raw: int) -> Number:
    """Return the value of a mapped object from the 32 bits of a message.

    A negative number may come zero-extended to its type or sign-extended to 32 bits.

    Raises:
        CodecError: The value does not fit the object.
    """
    raw = _narrowed(mapped.data_type, mapped.bits, raw)
    if raw >> min(mapped.bits, 32):
        raise CodecError(f'0x{raw:X} does not fit the {mapped.bits} bits of the object')
    return PdoCodec([mapped]).unpack(struct.pack('<Q', raw))[0]
