# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of PDO mapping and its codec (CiA 301, 7.4.7.1 and 7.5.2.36)."""

from collections.abc import Sequence
import struct

from hypothesis import given
from hypothesis import strategies as st
import pytest

from canopen_core import CodecError
from canopen_core.standard import (
    DataType,
    FIXED_BITS,
    integer_range,
    MappedObject,
    Number,
    PDO_BITS_MAX,
    PdoCodec,
    REAL_FORMATS,
    SIGNED_BITS,
)

pytestmark = pytest.mark.slow

MAPPABLE = sorted(FIXED_BITS)


@st.composite
def mappings(draw: st.DrawFn) -> list[MappedObject]:
    """Draw a mapping that fills a PDO more or less."""
    mapping: list[MappedObject] = []
    free = PDO_BITS_MAX
    for data_type in draw(st.lists(st.sampled_from(MAPPABLE), max_size=12)):
        if FIXED_BITS[data_type] <= free:
            free -= FIXED_BITS[data_type]
            index = draw(st.integers(0x2000, 0xFFFF))
            mapping.append(MappedObject(index, draw(st.integers(0, 255)), data_type))
    return mapping


def value_of(data_type: DataType) -> st.SearchStrategy[Number]:
    """Draw a value that a type can hold."""
    if data_type in REAL_FORMATS:
        return st.floats(width=32, allow_nan=False)
    low, high = integer_range(data_type) or (0, (1 << FIXED_BITS[data_type]) - 1)
    return st.integers(low, high)


def bits_of(data_type: DataType, value: Number) -> str:
    """Write a value as text of zeros and ones, least significant bit first: the oracle."""
    if data_type in REAL_FORMATS:
        raw = struct.pack(REAL_FORMATS[data_type], value)
        pattern = int.from_bytes(raw, 'little')
    else:
        pattern = int(value) % (1 << FIXED_BITS[data_type])
    return f'{pattern:0{FIXED_BITS[data_type]}b}'[::-1]


def bytes_of(bits: str) -> bytes:
    """Cut a text of bits, least significant first, into bytes."""
    padded = bits + '0' * (-len(bits) % 8)
    return bytes(int(padded[i : i + 8][::-1], 2) for i in range(0, len(padded), 8))


@given(mapping=mappings(), data=st.data())
def test_the_payload_is_the_bits_one_behind_the_other(
    mapping: Sequence[MappedObject], data: st.DataObject
) -> None:
    """Packing is bit-exact: the first object in the lowest bits, unused bits zero."""
    values = [data.draw(value_of(mapped.data_type)) for mapped in mapping]
    bits = ''.join(
        bits_of(mapped.data_type, value) for mapped, value in zip(mapping, values, strict=True)
    )
    payload = PdoCodec(mapping).pack(values)
    assert payload == bytes_of(bits)


@given(mapping=mappings(), data=st.data())
def test_values_survive_the_round_trip(
    mapping: Sequence[MappedObject], data: st.DataObject
) -> None:
    """Unpacking gives the packed values, also when bytes follow the mapped ones."""
    codec = PdoCodec(mapping)
    values = tuple(data.draw(value_of(mapped.data_type)) for mapped in mapping)
    payload = codec.pack(values)
    surplus = data.draw(st.binary(max_size=8 - codec.size))
    assert codec.unpack(payload) == values
    assert codec.unpack(payload + surplus) == values


@given(mapping=mappings(), data=st.data())
def test_a_payload_is_long_enough_or_refused(
    mapping: Sequence[MappedObject], data: st.DataObject
) -> None:
    """Bytes shorter than the mapping are refused; all others are values of the types."""
    codec = PdoCodec(mapping)
    payload = data.draw(st.binary(max_size=8))
    if len(payload) < codec.size:
        with pytest.raises(CodecError, match='shorter'):
            codec.unpack(payload)
        return
    for mapped, value in zip(mapping, codec.unpack(payload), strict=True):
        limits = integer_range(mapped.data_type)
        assert limits is None or limits[0] <= value <= limits[1]


@given(mapping=mappings(), data=st.data())
def test_a_value_out_of_range_is_refused(
    mapping: Sequence[MappedObject], data: st.DataObject
) -> None:
    """No value is cut to its length silently, on either path; nor is one too many or too few."""
    integers = [place for place, mapped in enumerate(mapping) if integer_range(mapped.data_type)]
    if not integers:
        return
    values: list[Number] = [0 for _ in mapping]
    place = data.draw(st.sampled_from(integers))
    low, high = integer_range(mapping[place].data_type) or (0, 0)
    values[place] = data.draw(st.sampled_from((low - 1, high + 1, 0.5)))
    with pytest.raises(CodecError):
        PdoCodec(mapping).pack(values)
    for wrong in ([0, *[0 for _ in mapping]], [0 for _ in mapping[1:]]):
        with pytest.raises(CodecError, match='values'):
            PdoCodec(mapping).pack(wrong)


@given(
    index=st.integers(0, 0xFFFF),
    subindex=st.integers(0, 0xFF),
    data_type=st.sampled_from(MAPPABLE),
)
def test_the_mapping_word_holds_index_subindex_and_length(
    index: int, subindex: int, data_type: DataType
) -> None:
    """The word that 0x1600 and 0x1A00 hold is index, sub-index and bits, big end first."""
    word = MappedObject(index, subindex, data_type).word
    assert struct.pack('>I', word) == struct.pack('>HBB', index, subindex, FIXED_BITS[data_type])


def test_mappings_that_cannot_be_are_refused() -> None:
    """64 bits fit, one more does not; strings and domains have no place in a PDO."""
    eight = [MappedObject(0x2000, 0, DataType.UNSIGNED64)]
    assert PdoCodec(eight).size == 8
    with pytest.raises(CodecError, match='65'):
        PdoCodec([*eight, MappedObject(0x2001, 0, DataType.BOOLEAN)])
    with pytest.raises(CodecError, match='VISIBLE_STRING'):
        PdoCodec([MappedObject(0x1008, 0, DataType.VISIBLE_STRING)])


@pytest.mark.parametrize('data_type', sorted(SIGNED_BITS), ids=lambda data_type: data_type.name)
def test_negative_numbers_pass_between_booleans(data_type: DataType) -> None:
    """A signed object that does not begin at a byte keeps its sign."""
    if FIXED_BITS[data_type] > 62:
        return
    flag = MappedObject(0x2000, 0, DataType.BOOLEAN)
    codec = PdoCodec([flag, MappedObject(0x2001, 0, data_type), flag])
    assert codec.unpack(codec.pack((1, -1, 1))) == (1, -1, 1)
    assert codec.unpack(codec.pack((0, -2, 0))) == (0, -2, 0)
