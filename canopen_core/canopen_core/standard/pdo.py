# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""PDO mapping and its codec (CiA 301, 7.5.2.36 and 7.1.4).

The codec is compiled once per mapping: byte-aligned mappings of common types become one
``struct.Struct``, everything else goes through a bit-exact path.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
import struct

from ..exceptions import CodecError
from .datatypes import DataType, FIXED_BITS, integer_range, REAL_FORMATS, SIGNED_BITS
from .objects import PDO_BITS_MAX

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
    """Return index, sub-index and length in [bit] that an entry of a mapping object names."""
    return word >> 16, word >> 8 & 0xFF, word & MAPPED_LENGTH_MASK


class PdoCodec:
    """Packs and unpacks the payload of one PDO."""

    def __init__(self, objects: Sequence[MappedObject]) -> None:
        """Compile the mapping.

        Raises:
            CodecError: The objects are longer than 64 bits together, or one has no fixed length.
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
