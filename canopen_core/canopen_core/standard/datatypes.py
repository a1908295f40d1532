# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Data types (CiA 301, 7.4.7), their encoding (7.1.4), and the codec of PDOs (7.5.2.36)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
import math
import struct
from typing import TypeAlias

from ..exceptions import CodecError
from .objects import PDO_BITS_MAX

Value: TypeAlias = bool | int | float | str | bytes


class DataType(IntEnum):
    """Static and basic data types by their object dictionary index (CiA 301, table 44)."""

    BOOLEAN = 0x01
    INTEGER8 = 0x02
    INTEGER16 = 0x03
    INTEGER32 = 0x04
    UNSIGNED8 = 0x05
    UNSIGNED16 = 0x06
    UNSIGNED32 = 0x07
    REAL32 = 0x08
    VISIBLE_STRING = 0x09
    OCTET_STRING = 0x0A
    UNICODE_STRING = 0x0B
    TIME_OF_DAY = 0x0C
    TIME_DIFFERENCE = 0x0D
    DOMAIN = 0x0F
    INTEGER24 = 0x10
    REAL64 = 0x11
    INTEGER40 = 0x12
    INTEGER48 = 0x13
    INTEGER56 = 0x14
    INTEGER64 = 0x15
    UNSIGNED24 = 0x16
    UNSIGNED40 = 0x18
    UNSIGNED48 = 0x19
    UNSIGNED56 = 0x1A
    UNSIGNED64 = 0x1B


_INTEGER_BITS = (8, 16, 24, 32, 40, 48, 56, 64)
SIGNED_BITS = {DataType[f'INTEGER{bits}']: bits for bits in _INTEGER_BITS}
UNSIGNED_BITS = {DataType[f'UNSIGNED{bits}']: bits for bits in _INTEGER_BITS}
TIME_BITS: dict[DataType, int] = {DataType.TIME_OF_DAY: 48, DataType.TIME_DIFFERENCE: 48}
REAL_FORMATS: dict[DataType, str] = {DataType.REAL32: '<f', DataType.REAL64: '<d'}
TEXT_ENCODINGS: dict[DataType, str] = {
    DataType.VISIBLE_STRING: 'latin-1',
    DataType.OCTET_STRING: 'latin-1',
    DataType.UNICODE_STRING: 'utf-16-le',
}
FIXED_BITS: dict[DataType, int] = {
    DataType.BOOLEAN: 1,
    **SIGNED_BITS,
    **UNSIGNED_BITS,
    **{data_type: 8 * struct.calcsize(code) for data_type, code in REAL_FORMATS.items()},
    **TIME_BITS,
}


def bit_length(data_type: DataType) -> int | None:
    """Return the length of a value in [bit], or None for strings and domains."""
    return FIXED_BITS.get(data_type)


def byte_length(data_type: DataType) -> int | None:
    """Return the length of a value in an SDO in [byte], or None for strings and domains."""
    bits = FIXED_BITS.get(data_type)
    return None if bits is None else (bits + 7) // 8


def integer_range(data_type: DataType) -> tuple[int, int] | None:
    """Return the smallest and largest value of an integer type, or None for other types."""
    if data_type is DataType.BOOLEAN:
        return 0, 1
    if (bits := SIGNED_BITS.get(data_type)) is not None:
        return -(1 << (bits - 1)), (1 << (bits - 1)) - 1
    if (bits := UNSIGNED_BITS.get(data_type)) is not None:
        return 0, (1 << bits) - 1
    return None


def encode(data_type: DataType, value: Value) -> bytes:
    """Encode a value for an SDO (CiA 301, 7.1.4): little-endian, with the length of its type.

    Strings are str; octet strings, times and domains are bytes.

    Raises:
        CodecError: The value has the wrong Python type, or is out of range.
    """
    if data_type in REAL_FORMATS:
        return _encode_real(data_type, value)
    if (limits := integer_range(data_type)) is not None:
        return _encode_integer(data_type, value, *limits)
    if isinstance(value, str) and data_type in TEXT_ENCODINGS:
        return _encode_text(data_type, value)
    if isinstance(value, bytes):
        expected = byte_length(data_type)
        if expected in (None, len(value)):
            return value
        raise CodecError(f'{data_type.name} takes {expected} bytes, got {len(value)}')
    raise CodecError(f'{data_type.name} cannot hold {value!r} ({type(value).__name__})')


def _encode_text(data_type: DataType, value: str) -> bytes:
    try:
        return value.encode(TEXT_ENCODINGS[data_type])
    except UnicodeEncodeError as error:
        raise CodecError(f'{data_type.name} cannot hold {value!r}: {error.reason}') from error


def _encode_real(data_type: DataType, value: Value) -> bytes:
    if isinstance(value, (str, bytes)):
        raise CodecError(f'{data_type.name} takes a number, got {value!r}')
    try:
        return struct.pack(REAL_FORMATS[data_type], value)
    except (OverflowError, struct.error) as error:
        raise CodecError(f'{value!r} does not fit {data_type.name}') from error


def _encode_integer(data_type: DataType, value: Value, low: int, high: int) -> bytes:
    if isinstance(value, float) and math.isfinite(value) and value.is_integer():
        value = int(value)
    if not isinstance(value, int):
        raise CodecError(f'{data_type.name} takes a whole number, got {value!r}')
    if not low <= value <= high:
        raise CodecError(f'{value} does not fit {data_type.name} ({low} to {high})')
    size = (FIXED_BITS[data_type] + 7) // 8
    return int(value).to_bytes(size, 'little', signed=low < 0)


def decode(data_type: DataType, data: bytes) -> Value:
    """Decode bytes from an SDO into a value; the inverse of :func:`encode`.

    Raises:
        CodecError: The number of bytes does not fit the type.
    """
    expected = byte_length(data_type)
    if expected is not None and len(data) != expected:
        raise CodecError(f'{data_type.name} takes {expected} bytes, got {len(data)}')
    if data_type in REAL_FORMATS:
        (real,) = struct.unpack(REAL_FORMATS[data_type], data)
        return float(real)
    if data_type is DataType.BOOLEAN:
        return data[0] != 0
    if data_type in SIGNED_BITS or data_type in UNSIGNED_BITS:
        return int.from_bytes(data, 'little', signed=data_type in SIGNED_BITS)
    if data_type is DataType.VISIBLE_STRING:
        return data.decode('latin-1')
    if data_type is DataType.UNICODE_STRING:
        return data.decode('utf-16-le', errors='replace')
    return data


Number = int | float

SYNCHRONOUS_MAX = 240  # transmission types up to this one follow SYNC (CiA 301, tables 69 and 71)
EVENT_DRIVEN = 254  # transmission types from which on a PDO has an event timer (CiA 301, table 72)

MAPPED_LENGTH_MASK = 0x7F  # bit 7 of the length is a flag of the vendor in some devices

STRUCT_CODES: dict[DataType, str] = {
    DataType.INTEGER8: 'b',
    DataType.INTEGER16: 'h',
    DataType.INTEGER32: 'i',
    DataType.INTEGER64: 'q',
    DataType.UNSIGNED8: 'B',
    DataType.UNSIGNED16: 'H',
    DataType.UNSIGNED32: 'I',
    DataType.UNSIGNED64: 'Q',
    DataType.REAL32: 'f',
    DataType.REAL64: 'd',
}


@dataclass(frozen=True, slots=True)
class MappedObject:
    """One object in a PDO."""

    index: int
    subindex: int
    data_type: DataType  # how the bits are read; its length is the length in the PDO

    @property
    def bits(self) -> int:
        """Length in the PDO in [bit]."""
        return FIXED_BITS[self.data_type]

    @property
    def word(self) -> int:
        """Entry of the mapping object: index, sub-index and length (CiA 301, figure 73)."""
        return self.index << 16 | self.subindex << 8 | self.bits


def mapped_place(word: int) -> tuple[int, int, int]:
    """Return index, sub-index and length in [bit] from an entry of a mapping object."""
    return word >> 16, word >> 8 & 0xFF, word & MAPPED_LENGTH_MASK


class PdoCodec:
    """Packs and unpacks the payload of one PDO.

    Byte-aligned mappings of common types become one ``struct.Struct``, all others go through a
    bit-exact path.
    """

    def __init__(self, objects: Sequence[MappedObject]) -> None:
        """Compile the mapping.

        Raises:
            CodecError: The objects exceed 64 bits in total, or one has no fixed length.
        """
        self.objects = tuple(objects)  # the mapped objects in their order
        for entry in self.objects:
            if entry.data_type not in FIXED_BITS:
                raise CodecError(f'{entry.data_type.name} has no fixed length, no PDO carries it')
        bits = sum(entry.bits for entry in self.objects)
        if bits > PDO_BITS_MAX:
            raise CodecError(f'a PDO carries at most {PDO_BITS_MAX} bits, this mapping has {bits}')
        self.size = (bits + 7) // 8  # length of the payload in [byte]
        codes = [STRUCT_CODES.get(entry.data_type) for entry in self.objects]
        self._struct = (
            struct.Struct('<' + ''.join(code for code in codes if code)) if all(codes) else None
        )

    def unpack(self, data: bytes) -> tuple[Number, ...]:
        """Return the values of a payload, in the order of the mapping.

        Raises:
            CodecError: The payload is shorter than the mapping; longer ones are read from their
                start, as CiA 301, 7.2.2.5 requires.
        """
        if len(data) < self.size:
            raise CodecError(f'PDO of {len(data)} bytes is shorter than its mapping ({self.size})')
        if self._struct is not None:
            return self._struct.unpack_from(data)
        word = int.from_bytes(data, 'little')
        values = []
        for entry in self.objects:
            values.append(_from_bits(entry.data_type, word & ((1 << entry.bits) - 1)))
            word >>= entry.bits
        return tuple(values)

    def pack(self, values: Sequence[Number]) -> bytes:
        """Return the payload for values in the order of the mapping.

        Raises:
            CodecError: A value does not fit its type, or their number is wrong.
        """
        if self._struct is not None:
            try:
                return self._struct.pack(*values)  # in each cycle, so nothing is checked twice
            except (struct.error, OverflowError) as error:
                self._check_count(values)
                raise CodecError(f'{list(values)} does not fit the mapping: {error}') from error
        self._check_count(values)
        word, shift = 0, 0
        for entry, value in zip(self.objects, values, strict=True):
            word |= _to_bits(entry.data_type, value) << shift
            shift += entry.bits
        return word.to_bytes(self.size, 'little')

    def _check_count(self, values: Sequence[Number]) -> None:
        if len(values) != len(self.objects):
            raise CodecError(f'the PDO has {len(self.objects)} objects, got {len(values)} values')


def _from_bits(data_type: DataType, bits: int) -> Number:
    if data_type in REAL_FORMATS:
        size = FIXED_BITS[data_type] // 8
        return float(struct.unpack(REAL_FORMATS[data_type], bits.to_bytes(size, 'little'))[0])
    width = SIGNED_BITS.get(data_type)
    if width is not None and bits >> (width - 1):
        return bits - (1 << width)
    return bits


def _to_bits(data_type: DataType, value: Number) -> int:
    if data_type in REAL_FORMATS:
        try:
            return int.from_bytes(struct.pack(REAL_FORMATS[data_type], value), 'little')
        except (OverflowError, struct.error) as error:
            raise CodecError(f'{value} does not fit {data_type.name}') from error
    limits = integer_range(data_type) or (0, (1 << FIXED_BITS[data_type]) - 1)
    if not isinstance(value, int) or not limits[0] <= value <= limits[1]:
        raise CodecError(f'{value} does not fit {data_type.name} ({limits[0]} to {limits[1]})')
    return value & ((1 << FIXED_BITS[data_type]) - 1)
