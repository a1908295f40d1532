# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Objects as 32 raw bits: nothing is lost that fits, and what does not fit is refused."""

from __future__ import annotations

import struct

from hypothesis import assume, given
from hypothesis import strategies as st
import pytest

from arm_canopen import CodecError
from arm_canopen.nodes.device_node import (
    bytes_from_raw,
    number_from_raw,
    raw_from_bytes,
    raw_from_number,
)
from canopen_core.standard import (
    byte_length,
    DataType,
    decode,
    encode,
    integer_range,
    MappedObject,
    SIGNED_BITS,
)

RAW = st.integers(0, 0xFFFF_FFFF)
SMALL = [t for t in DataType if (byte_length(t) or 9) <= 4]
LARGE = [t for t in DataType if t not in SMALL]
SMALL_INTEGERS = [t for t in SMALL if integer_range(t) is not None]


@st.composite
def integers(draw: st.DrawFn) -> tuple[DataType, int]:
    """Draw an integer type of up to 32 bits and a value that fits it."""
    data_type = draw(st.sampled_from(SMALL_INTEGERS))
    low, high = integer_range(data_type) or (0, 0)
    return data_type, draw(st.integers(low, high))


@given(st.binary(max_size=4))
def test_up_to_four_bytes_are_little_endian(data: bytes) -> None:
    """The 32 bits are the bytes, zero-extended."""
    assert raw_from_bytes(data) == struct.unpack('<I', data.ljust(4, b'\0'))[0]


@given(st.binary(min_size=5, max_size=20))
def test_more_than_four_bytes_are_refused(data: bytes) -> None:
    """Nothing is cut off in silence."""
    with pytest.raises(CodecError, match=f'{len(data)} bytes'):
        raw_from_bytes(data)


@given(integers())
def test_integers_survive_a_round_trip(sample: tuple[DataType, int]) -> None:
    """A value encoded, carried as 32 bits and decoded again is itself."""
    data_type, value = sample
    raw = raw_from_bytes(encode(data_type, value))
    assert decode(data_type, bytes_from_raw(data_type, raw)) == value


@given(integers())
def test_negative_numbers_may_come_with_all_32_bits(sample: tuple[DataType, int]) -> None:
    """Sign-extended as a C program would send them, they mean the same, by SDO and by PDO."""
    data_type, value = sample
    raw = value & 0xFFFF_FFFF
    assert decode(data_type, bytes_from_raw(data_type, raw)) == value
    assert number_from_raw(MappedObject(0x2000, 0, data_type), raw) == value


@given(st.sampled_from(SMALL_INTEGERS), RAW)
def test_what_does_not_fit_is_refused(data_type: DataType, raw: int) -> None:
    """Only zero-extended and sign-extended values are values."""
    low, high = integer_range(data_type) or (0, 0)
    bits = 8 * (byte_length(data_type) or 0)
    values = {raw, raw - (1 << bits), raw - (1 << 32)} if data_type in SIGNED_BITS else {raw}
    assume(not any(low <= value <= high for value in values))
    with pytest.raises(CodecError, match='does not fit'):
        bytes_from_raw(data_type, raw)
    with pytest.raises(CodecError, match='does not fit'):
        number_from_raw(MappedObject(0x2000, 0, data_type), raw)


@pytest.mark.parametrize('data_type', LARGE, ids=lambda data_type: data_type.name)
def test_larger_types_are_refused(data_type: DataType) -> None:
    """What has more than 32 bits, or no fixed length, is not for this message."""
    with pytest.raises(CodecError, match=data_type.name):
        bytes_from_raw(data_type, 0)


@given(st.floats(width=32, allow_nan=False))
def test_real_numbers_travel_as_their_bits(value: float) -> None:
    """REAL32 is carried bit by bit."""
    mapped = MappedObject(0x2000, 0, DataType.REAL32)
    raw = raw_from_number(mapped, value)
    assert raw == struct.unpack('<I', struct.pack('<f', value))[0]
    assert number_from_raw(mapped, raw) == value
    assert bytes_from_raw(DataType.REAL32, raw) == struct.pack('<f', value)


@given(integers())
def test_values_of_pdos_survive_a_round_trip(sample: tuple[DataType, int]) -> None:
    """A received value, published as 32 bits and sent back, is itself."""
    data_type, value = sample
    mapped = MappedObject(0x2000, 0, data_type)
    raw = raw_from_number(mapped, value)
    assert 0 <= raw <= 0xFFFF_FFFF
    assert number_from_raw(mapped, raw) == value
