# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Values as text: in an EDS or DCF (CiA 306-1, 4.6.3), and for services and command lines."""

from __future__ import annotations

from dataclasses import dataclass
import re
import struct

from ..exceptions import CodecError
from ..standard.datatypes import (
    byte_length,
    DataType,
    decode,
    encode,
    FIXED_BITS,
    integer_range,
    REAL_FORMATS,
    TIME_BITS,
    Value,
)

NODE_ID_TERM = '$NODEID'
INTEGER = re.compile(r'[-+]?(?:0[xX][0-9a-fA-F]+|[0-9]+)')
ASSEMBLER_HEX = re.compile(r'[0-9a-fA-F]+[hH]')  # 60400010h, as some vendors' files have it
INTEGER_DIGITS_MAX = 40  # longer than any 64-bit number in any notation
BOOLEAN_WORDS = {'true': True, 'false': False}


@dataclass(frozen=True, slots=True)
class EdsValue:
    """A value as an EDS gives it."""

    value: Value  # the value; of a sum with ``$NODEID`` all but the node id
    node_relative: bool = False  # the node id is to be added


def parse_integer(text: str) -> int:
    """Read a whole number: decimal (leading zeros allowed) or hexadecimal with ``0x``.

    A comment behind it (``; ...``) is ignored.

    Raises:
        ValueError: It is none.
    """
    text = text.partition(';')[0].strip()
    if len(text) > INTEGER_DIGITS_MAX or not INTEGER.fullmatch(text):
        hint = f': write 0x{text[:-1]}' if ASSEMBLER_HEX.fullmatch(text[:40]) else ''
        raise ValueError(f'{text[:40]!r} is not a whole number{hint}')
    return int(text, 16 if 'x' in text.lower() else 10)


def parse_value(data_type: DataType, text: str) -> EdsValue | None:
    """Read a DefaultValue, ParameterValue or limit.

    Returns:
        The value, or None when the text is empty or the type has no value in a file (DOMAIN).

    Raises:
        ValueError: The text is no value of this type.
    """
    if not text or data_type is DataType.DOMAIN:
        return None
    if data_type is DataType.VISIBLE_STRING:
        return EdsValue(text)
    if data_type is DataType.UNICODE_STRING:
        return EdsValue(_unicode_string(text))
    if data_type is DataType.OCTET_STRING:
        return EdsValue(bytes.fromhex(text))
    if data_type in REAL_FORMATS:
        return EdsValue(_real(data_type, text))
    limits = integer_range(data_type)
    if limits is None:
        return EdsValue(_time(data_type, text))
    if data_type is DataType.BOOLEAN and text.lower() in BOOLEAN_WORDS:
        return EdsValue(BOOLEAN_WORDS[text.lower()])
    return _integer(data_type, text, *limits)


def _integer(data_type: DataType, text: str, low: int, high: int) -> EdsValue | None:
    terms = [term.strip() for term in text.partition(';')[0].split('+')]
    numbers = [term for term in terms if term.upper() != NODE_ID_TERM]
    relative = len(terms) - len(numbers)
    if relative > 1:
        raise ValueError(f'{text[:40]!r} adds the node id more than once')
    if terms == ['']:
        return None
    if len(terms) > 1 and not relative:
        numbers = [text]  # '+5' is a number, '1+2' is none
    value = sum(parse_integer(number) for number in numbers)
    if low < 0 and high < value < 1 << FIXED_BITS[data_type]:
        value -= 1 << FIXED_BITS[data_type]  # 0xFF of an INTEGER8 is -1
    if not low <= value <= high:
        raise ValueError(f'{text[:40]} does not fit {data_type.name} ({low} to {high})')
    return EdsValue(value, bool(relative))


def _real(data_type: DataType, text: str) -> float:
    text = text.partition(';')[0].strip()
    size = FIXED_BITS[data_type] // 8
    try:
        if not text.lower().startswith('0x'):
            struct.pack(REAL_FORMATS[data_type], real := float(text))
            return real
        bits = parse_integer(text).to_bytes(size, 'little')  # of the number
    except OverflowError as error:
        raise ValueError(f'{text[:40]} does not fit {data_type.name}') from error
    return float(struct.unpack(REAL_FORMATS[data_type], bits)[0])


def _unicode_string(text: str) -> str:
    """Read UTF-16 as hexadecimal digits, as the standard wants it, or as plain text."""
    try:
        return bytes.fromhex(text).decode('utf-16-be')
    except (ValueError, UnicodeDecodeError):
        return text


def _time(data_type: DataType, text: str) -> bytes:
    size = byte_length(data_type) or 0
    try:
        return parse_integer(text).to_bytes(size, 'little')
    except OverflowError as error:
        raise ValueError(f'{text[:40]} does not fit {data_type.name}') from error


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
