# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Values of EDS files in all notations that vendors use."""

import math
import re
import struct

from hypothesis import example, given
from hypothesis import strategies as st
import pytest

from arm_canopen.config.read.eds_values import EdsValue, parse_integer, parse_value
from arm_canopen.standard import DataType, integer_range, SIGNED_BITS, UNSIGNED_BITS
from arm_canopen.standard.datatypes import decode, encode, Value

INTEGERS = [*SIGNED_BITS, *UNSIGNED_BITS]


@pytest.mark.parametrize(
    ('text', 'value'),
    [
        ('0', 0),
        ('001', 1),
        ('010', 10),  # decimal: vendors pad, nobody means octal
        ('42', 42),
        ('-3', -3),
        ('+7', 7),
        ('0x1A', 26),
        ('0X1a', 26),
        ('-0x10', -16),
        ('0x6040 ; controlword', 0x6040),
    ],
)
def test_whole_numbers(text: str, value: int) -> None:
    """Decimal with or without padding, hexadecimal in any case, with a comment behind."""
    assert parse_integer(text) == value


@pytest.mark.parametrize('text', ['', 'abc', '0x', '1.5', '1_000', '1 2', '--1', '9' * 50, '٣'])
def test_what_is_no_number_is_refused(text: str) -> None:
    """Nothing is guessed; the message shows the text."""
    with pytest.raises(ValueError, match='not a whole number'):
        parse_integer(text)


@given(data_type=st.sampled_from(INTEGERS), data=st.data())
def test_every_integer_is_read_in_both_notations(data_type: DataType, data: st.DataObject) -> None:
    """Decimal and two's complement in hexadecimal mean the same value."""
    low, high = integer_range(data_type) or (0, 0)
    value = data.draw(st.integers(low, high))
    pattern = value % (high - low + 1)
    assert parse_value(data_type, str(value)) == EdsValue(value)
    assert parse_value(data_type, f'0x{pattern:X}') == EdsValue(value)


@pytest.mark.parametrize(
    ('text', 'expected'),
    [
        ('$NODEID+0x180', EdsValue(0x180, node_relative=True)),
        ('$nodeid + 0x180', EdsValue(0x180, node_relative=True)),
        ('0x200+$NODEID', EdsValue(0x200, node_relative=True)),
        ('$NODEID', EdsValue(0, node_relative=True)),
        ('$NODEID+0x80000000+0x280', EdsValue(0x8000_0280, node_relative=True)),
        ('$NODEID+384 ; TPDO 1', EdsValue(384, node_relative=True)),
    ],
)
def test_sums_with_the_node_id(text: str, expected: EdsValue) -> None:
    """The node id stands on either side, in any case, with any blanks."""
    assert parse_value(DataType.UNSIGNED32, text) == expected


@pytest.mark.parametrize(
    ('data_type', 'text', 'message'),
    [
        (DataType.UNSIGNED8, '256', 'does not fit UNSIGNED8'),
        (DataType.UNSIGNED8, '-1', 'does not fit UNSIGNED8'),
        (DataType.INTEGER8, '256', 'does not fit INTEGER8'),
        (DataType.INTEGER8, '-129', 'does not fit INTEGER8'),
        (DataType.UNSIGNED32, '$NODEID+$NODEID', 'more than once'),
        (DataType.UNSIGNED32, '$NODEID-1', 'not a whole number'),
        (DataType.UNSIGNED32, '1+2', 'not a whole number'),
        (DataType.REAL32, 'much', 'could not convert'),
        (DataType.REAL32, '0x1FFFFFFFF', 'does not fit REAL32'),
        (DataType.OCTET_STRING, 'zz', 'non-hexadecimal'),
        (DataType.TIME_OF_DAY, '-1', 'does not fit TIME_OF_DAY'),
    ],
)
def test_values_that_do_not_fit_are_refused(data_type: DataType, text: str, message: str) -> None:
    """The reason names the text or the type."""
    with pytest.raises(ValueError, match=message):
        parse_value(data_type, text)


@pytest.mark.parametrize(
    ('data_type', 'text', 'value'),
    [
        (DataType.BOOLEAN, '1', 1),
        (DataType.BOOLEAN, 'TRUE', True),
        (DataType.BOOLEAN, 'false', False),
        (DataType.VISIBLE_STRING, 'Drive; rev. 2', 'Drive; rev. 2'),
        (DataType.OCTET_STRING, '0A 1B2c', b'\x0a\x1b\x2c'),
        (DataType.UNICODE_STRING, '00410042', 'AB'),
        (DataType.UNICODE_STRING, 'plain', 'plain'),
        (DataType.TIME_DIFFERENCE, '1', b'\x01\0\0\0\0\0'),
        (DataType.REAL32, '1.5 ; gain', 1.5),
        (DataType.REAL64, '-2e-3', -0.002),
    ],
)
def test_other_types(data_type: DataType, text: str, value: Value) -> None:
    """Booleans, strings, octets, times and reals, as files write them."""
    assert parse_value(data_type, text) == EdsValue(value)


@given(value=st.floats(width=32))
def test_hexadecimal_reals_are_bits(value: float) -> None:
    """A real in hexadecimal gives the bits of the number (CiA 306-1)."""
    (bits,) = struct.unpack('<I', struct.pack('<f', value))
    parsed = parse_value(DataType.REAL32, f'0x{bits:08X}')
    assert parsed is not None
    assert parsed.value == value or (math.isnan(value) and math.isnan(float(parsed.value)))


@given(data_type=st.sampled_from(DataType))
def test_an_empty_text_is_no_value(data_type: DataType) -> None:
    """Empty keys are common and mean nothing."""
    assert parse_value(data_type, '') is None


TEXTS = st.one_of(
    st.text(max_size=20),
    st.text(alphabet='0123456789abcdefx$NODEIDnodeid+-.; ', max_size=20),
    st.integers(-(2**70), 2**70).map(str),
    st.floats().map(str),
)


@given(data_type=st.sampled_from(DataType), text=TEXTS)
@example(data_type=DataType.REAL32, text='3.5e38')
def test_any_text_is_a_value_of_the_type_or_refused(data_type: DataType, text: str) -> None:
    """What is read can be written to the device and read back; a refusal has a reason."""
    try:
        parsed = parse_value(data_type, text)
    except ValueError as error:
        limits = integer_range(data_type) or (0, -1)
        is_value = bool(re.fullmatch('[0-9]{1,30}', text)) and int(text) <= limits[1]
        assert (bool(str(error)), is_value) == (True, False)  # noqa: PT017  # half of the law
        return
    if parsed is None:
        assert data_type is DataType.DOMAIN or not text.partition(';')[0].strip()
        return
    if data_type is DataType.VISIBLE_STRING:
        assert parsed.value == text
        return
    decoded = decode(data_type, encode(data_type, parsed.value))
    if isinstance(decoded, float) and isinstance(parsed.value, float):
        assert decoded == pytest.approx(parsed.value, rel=1e-6, nan_ok=True)
    else:
        assert decoded == parsed.value
