# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Values of objects as text, for services and command lines."""

from __future__ import annotations

from ...exceptions import CodecError
from ...standard.datatypes import DataType, decode, encode, TIME_BITS
from .eds_values import parse_value

BYTE_TYPES = frozenset({DataType.DOMAIN, DataType.OCTET_STRING, *TIME_BITS})
"""Types whose text is hexadecimal bytes."""


def text_from_bytes(data_type: DataType, data: bytes) -> str:
    """Write the bytes of an SDO as text: a number, true or false, a string, or hexadecimal bytes.

    Raises:
        CodecError: The bytes do not fit the type.
    """
    value = decode(data_type, data)
    if isinstance(value, bool):
        return str(value).lower()
    return value.hex(' ') if isinstance(value, bytes) else str(value)


def bytes_from_text(data_type: DataType, text: str) -> bytes:
    """Read a value from text; the inverse of :func:`text_from_bytes`.

    Whole numbers may be hexadecimal, with ``0x``.

    Raises:
        CodecError: The text is no value of this type.
    """
    if data_type in (DataType.VISIBLE_STRING, DataType.UNICODE_STRING):
        return encode(data_type, text)
    try:
        if data_type in BYTE_TYPES:
            return encode(data_type, bytes.fromhex(text))
        parsed = parse_value(data_type, text.strip())
    except CodecError:
        raise
    except ValueError as error:
        raise CodecError(f'{text[:40]!r} is no {data_type.name}: {error}') from error
    if parsed is None or parsed.node_relative:
        raise CodecError(f'{text[:40]!r} is no {data_type.name}')
    return encode(data_type, parsed.value)
