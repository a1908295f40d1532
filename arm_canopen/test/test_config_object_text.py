# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Values as text and back."""

from __future__ import annotations

import math
import struct

from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen import CodecError
from arm_canopen.config.read.eds_values import BYTE_TYPES, bytes_from_text, text_from_bytes
from arm_canopen.standard import byte_length, DataType, integer_range, REAL_FORMATS

NUMBERS = [data_type for data_type in DataType if integer_range(data_type) is not None]


@given(st.sampled_from(NUMBERS), st.data())
def test_numbers_come_back(data_type: DataType, data: st.DataObject) -> None:
    """Every value of every integer type, and of BOOLEAN."""
    low, high = integer_range(data_type) or (0, 0)
    value = data.draw(st.integers(low, high))
    size = byte_length(data_type) or 0
    raw = value.to_bytes(size, 'little', signed=low < 0)
    text = text_from_bytes(data_type, raw)
    assert bytes_from_text(data_type, text) == raw
    if data_type is not DataType.BOOLEAN:
        assert text == str(value)
    if value >= 0:
        assert bytes_from_text(data_type, f'0x{value:X}') == raw


@given(st.sampled_from(list(REAL_FORMATS)), st.floats(width=32, allow_nan=False))
def test_reals_come_back(data_type: DataType, value: float) -> None:
    """Infinities and denormals too."""
    raw = struct.pack(REAL_FORMATS[data_type], value)
    assert bytes_from_text(data_type, text_from_bytes(data_type, raw)) == raw


def test_nan_is_no_secret() -> None:
    """It is shown as what it is."""
    assert text_from_bytes(DataType.REAL32, struct.pack('<f', math.nan)) == 'nan'


@given(st.sampled_from(sorted(BYTE_TYPES)), st.binary(min_size=6, max_size=6))
def test_bytes_come_back(data_type: DataType, raw: bytes) -> None:
    """As hexadecimal digits, with or without spaces."""
    text = text_from_bytes(data_type, raw)
    assert bytes_from_text(data_type, text) == raw
    assert bytes_from_text(data_type, text.replace(' ', '')) == raw


@given(st.text(st.characters(max_codepoint=255), min_size=1))
def test_strings_come_back(text: str) -> None:
    """Every character that a VISIBLE_STRING of a real device may have."""
    raw = bytes_from_text(DataType.VISIBLE_STRING, text)
    assert text_from_bytes(DataType.VISIBLE_STRING, raw) == text


@pytest.mark.parametrize(
    ('data_type', 'text'),
    [
        (DataType.UNSIGNED8, '256'),
        (DataType.UNSIGNED8, '-1'),
        (DataType.INTEGER16, 'fast'),
        (DataType.INTEGER16, ''),
        (DataType.INTEGER16, '1.5'),
        (DataType.UNSIGNED32, '$NODEID+1'),
        (DataType.REAL32, 'much'),
        (DataType.DOMAIN, 'xyz'),
        (DataType.TIME_OF_DAY, '00 01'),
        (DataType.VISIBLE_STRING, '\u20ac'),
    ],
    ids=str,
)
def test_what_is_no_value_is_refused(data_type: DataType, text: str) -> None:
    """The message has the text or the type."""
    with pytest.raises(CodecError):
        bytes_from_text(data_type, text)
