# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of the data types' encoding (CiA 301, 7.1.4)."""

import math
import struct

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from canopen_core import CodecError
from canopen_core.standard import (
    bit_length,
    byte_length,
    DataType,
    decode,
    encode,
    FIXED_BITS,
    integer_range,
    SIGNED_BITS,
    UNSIGNED_BITS,
    Value,
)

pytestmark = pytest.mark.slow

INTEGERS = [*SIGNED_BITS, *UNSIGNED_BITS]
CTYPES_FORMATS = {
    DataType.INTEGER8: '<b',
    DataType.INTEGER16: '<h',
    DataType.INTEGER32: '<i',
    DataType.INTEGER64: '<q',
    DataType.UNSIGNED8: '<B',
    DataType.UNSIGNED16: '<H',
    DataType.UNSIGNED32: '<I',
    DataType.UNSIGNED64: '<Q',
}


def in_range(data_type: DataType) -> st.SearchStrategy[int]:
    """Draw integers of a type, its ends more often than others."""
    low, high = integer_range(data_type) or (0, 0)
    return st.integers(low, high) | st.sampled_from((low, high, 0))


@settings(max_examples=400)
@given(data_type=st.sampled_from(INTEGERS), data=st.data())
def test_an_integer_survives_the_round_trip(data_type: DataType, data: st.DataObject) -> None:
    """In as many bytes as the type has; 8, 16, 32 and 64 bit are what struct makes of them."""
    value = data.draw(in_range(data_type))
    encoded = encode(data_type, value)
    assert len(encoded) == byte_length(data_type) == FIXED_BITS[data_type] // 8
    assert decode(data_type, encoded) == value
    if data_type in CTYPES_FORMATS:
        assert encoded == struct.pack(CTYPES_FORMATS[data_type], value)


@settings(max_examples=400)
@given(data_type=st.sampled_from(INTEGERS), data=st.data())
def test_every_pattern_of_an_integer_is_a_value(data_type: DataType, data: st.DataObject) -> None:
    """Encoding what was decoded gives the same bytes: no two values share a pattern."""
    size = byte_length(data_type) or 0
    pattern = data.draw(st.binary(min_size=size, max_size=size))
    assert encode(data_type, decode(data_type, pattern)) == pattern


@settings(max_examples=400)
@given(data_type=st.sampled_from(INTEGERS), excess=st.integers(1, 1 << 70))
def test_an_integer_out_of_range_is_refused(data_type: DataType, excess: int) -> None:
    """One beyond either end is refused, never wrapped."""
    low, high = integer_range(data_type) or (0, 0)
    for value in (low - excess, high + excess):
        with pytest.raises(CodecError, match=data_type.name):
            encode(data_type, value)


@given(single=st.floats(width=32), double=st.floats())
def test_a_real64_survives_the_round_trip(single: float, double: float) -> None:
    """And a REAL32: exactly, infinities and NaN included."""
    for data_type, value in ((DataType.REAL32, single), (DataType.REAL64, double)):
        decoded = decode(data_type, encode(data_type, value))
        assert decoded == value or (math.isnan(value) and math.isnan(float(decoded)))


def test_a_number_too_large_for_a_real_is_refused() -> None:
    """An overflow of REAL32 or REAL64 is an error, not infinity."""
    for data_type, value in ((DataType.REAL32, 1e39), (DataType.REAL64, 10**400)):
        with pytest.raises(CodecError, match=data_type.name):
            encode(data_type, value)


@given(
    latin=st.text(st.characters(max_codepoint=0xFF)),
    text=st.text(st.characters(codec='utf-16')),
    data=st.binary(),
)
def test_strings_and_bytes_survive_the_round_trip(latin: str, text: str, data: bytes) -> None:
    """Latin-1, text of any script, octet strings and domains, which are their bytes."""
    assert decode(DataType.VISIBLE_STRING, encode(DataType.VISIBLE_STRING, latin)) == latin
    assert decode(DataType.UNICODE_STRING, encode(DataType.UNICODE_STRING, text)) == text
    for data_type in (DataType.DOMAIN, DataType.OCTET_STRING):
        assert encode(data_type, data) == decode(data_type, data) == data


VALUES: st.SearchStrategy[Value] = st.one_of(
    st.booleans(), st.integers(), st.floats(), st.text(), st.binary(max_size=12)
)


@given(data_type=st.sampled_from(DataType), value=VALUES)
def test_encoding_fails_with_codec_error_only(data_type: DataType, value: Value) -> None:
    """Whatever the value, the answer is bytes of the type's length or a CodecError."""
    try:
        encoded = encode(data_type, value)
    except CodecError:
        return
    assert byte_length(data_type) in (None, len(encoded))


@given(data_type=st.sampled_from(DataType), data=st.binary(max_size=12))
def test_decoding_fails_with_codec_error_only(data_type: DataType, data: bytes) -> None:
    """Bytes of the wrong length are refused, all others are a value."""
    expected = byte_length(data_type)
    if expected in (None, len(data)):
        decode(data_type, data)
    else:
        with pytest.raises(CodecError, match=data_type.name):
            decode(data_type, data)


def test_lengths_agree() -> None:
    """A type has a length in bytes exactly when it has one in bits; only BOOLEAN is shorter."""
    for data_type in DataType:
        bits, size = bit_length(data_type), byte_length(data_type)
        if bits is None or size is None:
            assert bits is size
        else:
            assert size * 8 == (8 if data_type is DataType.BOOLEAN else bits)
