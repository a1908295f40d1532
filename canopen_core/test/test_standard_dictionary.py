# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of the object dictionary, of names of objects, of COB-IDs and of data types."""

from contextlib import suppress
from itertools import product
import math
from pathlib import Path
import struct

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from canopen_core import CodecError, ObjectError
from canopen_core.eds import load_eds
from canopen_core.standard import (
    AccessType,
    byte_length,
    DataType,
    decode,
    encode,
    find_object,
    FIXED_BITS,
    integer_range,
    NODE_ID_MAX,
    NODE_ID_MIN,
    object_path,
    ObjectDictionary,
    ObjectEntry,
    rpdo_default,
    SIGNED_BITS,
    tpdo_default,
    UNSIGNED_BITS,
    Value,
)

ENTRIES = st.lists(
    st.builds(
        ObjectEntry,
        st.integers(0x1000, 0x1010),
        st.integers(0, 3),
        st.sampled_from(('a', 'b', 'c')),
        st.just(DataType.UNSIGNED32),
        default=st.none() | st.integers(0, 0x8000_0700),
        node_relative=st.booleans(),
    ),
    max_size=30,
)
NODE_IDS = st.integers(NODE_ID_MIN, NODE_ID_MAX)


@pytest.mark.slow
@given(entries=ENTRIES)
def test_entries_are_ascending_and_the_later_counts(entries: list[ObjectEntry]) -> None:
    """Iteration is by index and sub-index; of two with one address the last one given is kept.

    ``in``, ``get``, ``has_index``, ``subindices`` and ``len`` say the same.
    """
    dictionary = ObjectDictionary(entries)
    addresses = [entry.address for entry in dictionary]
    assert addresses == sorted({entry.address for entry in entries})
    assert len(dictionary) == len(addresses)
    latest = {entry.address: entry for entry in entries}
    for index in range(0x1000, 0x1012):
        parts = dictionary.subindices(index)
        assert dictionary.has_index(index) == bool(parts)
        for subindex in range(5):
            entry = dictionary.get(index, subindex)
            assert entry is latest.get((index, subindex))
            assert ((index, subindex) in dictionary) == (entry in parts) == (entry is not None)


@pytest.mark.slow
@given(entries=ENTRIES, node_id=NODE_IDS)
def test_node_relative_defaults_are_resolved_once(
    entries: list[ObjectEntry], node_id: int
) -> None:
    """The node id is added to ``$NODEID`` defaults only, and never a second time."""
    dictionary = ObjectDictionary(entries, source='x.eds')
    resolved = dictionary.for_node(node_id)
    assert resolved.source == 'x.eds'
    for before, after in zip(dictionary, resolved, strict=True):
        assert not after.node_relative
        if before.node_relative:
            assert after.default == int(before.default or 0) + node_id
        else:
            assert after == before
    assert list(resolved.for_node(node_id)) == list(resolved)


def test_access_decides_the_direction_of_mapping() -> None:
    """An object goes into the PDOs that its access allows, if it may be mapped at all."""
    tpdo_only = (AccessType.READ_ONLY, AccessType.CONSTANT, AccessType.READ_WRITE_TPDO)
    rpdo_only = (AccessType.WRITE_ONLY, AccessType.READ_WRITE_RPDO)
    for access in AccessType:
        entry = ObjectEntry(0x2000, 0, 'x', DataType.UNSIGNED8, access, pdo_mappable=True)
        expected = (access not in rpdo_only, access not in tpdo_only)
        assert (entry.tpdo_mappable, entry.rpdo_mappable) == expected, access
        hidden = ObjectEntry(0x2000, 0, 'x', DataType.UNSIGNED8, access)
        assert (hidden.tpdo_mappable, hidden.rpdo_mappable) == (False, False), access


def test_predefined_identifiers_never_collide() -> None:
    """All PDOs 1 to 4 of all nodes have identifiers of their own, in the standard's ranges."""
    identifiers = [
        default(number, node_id)
        for default in (tpdo_default, rpdo_default)
        for number in range(1, 5)
        for node_id in range(NODE_ID_MIN, NODE_ID_MAX + 1)
    ]
    assert len(set(identifiers)) == len(identifiers)
    assert min(identifiers) == 0x181
    assert max(identifiers) == 0x57F
    for default, number in product((tpdo_default, rpdo_default), (0, 5)):
        with pytest.raises(ValueError, match=f'PDO {number}'):
            default(number, 1)


def test_a_cob_id_of_another_node_id_is_that_of_the_device() -> None:
    """Where the file leaves out ``$NODEID``; what it means is kept, and so is the value itself."""
    for address, literal, file_node_id, cob_id in (
        ((0x1014, 0), 0x80, None, 0x83),
        ((0x1014, 0), 0, None, 0x83),
        ((0x1014, 0), 0x91, None, 0x83),
        ((0x1014, 0), 0x91, 0x11, 0x83),
        ((0x1014, 0), 0x91, 3, 0x91),  # the file is for this device, and means it
        ((0x1014, 0), 0x8000_0091, None, 0x8000_0083),
        ((0x1400, 1), 0x205, None, 0x203),
        ((0x1400, 1), 0x185, 5, 0x185),  # listens to a TPDO of node 5
        ((0x1800, 1), 0x4000_0185, 5, 0x4000_0183),
        ((0x1803, 1), 0x483, None, 0x483),
        ((0x1804, 1), 0x685, None, 0x685),  # no pre-defined one
        ((0x1800, 1), 0x2000_0185, None, 0x2000_0185),
        ((0x2000, 0), 0x185, None, 0x185),
    ):
        written = ObjectEntry(*address, 'COB-ID', DataType.UNSIGNED32, default=literal)
        (entry,) = ObjectDictionary([written], node_id=file_node_id).for_node(3)
        assert entry.default == cob_id, (address, hex(literal), file_node_id)
        assert entry.literal == (None if cob_id == literal else literal)


EDS = Path(__file__).parents[2] / 'arm_canopen' / 'eds' / 'cia402_drive.eds'


@pytest.fixture(scope='module')
def dictionary() -> ObjectDictionary:
    """The simulated drive's."""
    return load_eds(EDS).dictionary


def test_every_object_is_found_by_its_number_and_by_its_path(dictionary: ObjectDictionary) -> None:
    """With and without 0x, in upper and lower case.

    Only where the EDS has two objects of one name the number is needed, and both are named.
    """
    paths = [object_path(entry).lower() for entry in dictionary]
    for entry in dictionary:
        for number in (
            f'0x{entry.index:04X}:{entry.subindex:02X}',
            f'{entry.index:04x}:{entry.subindex:x}',
            f' 0X{entry.index:04x}:0x{entry.subindex:02x} ',
        ):
            assert find_object(dictionary, number) is entry
        path = object_path(entry)
        if paths.count(path.lower()) == 1:
            assert find_object(dictionary, path.upper()) is entry
        else:
            with pytest.raises(ObjectError, match=f'0x{entry.index:04X}'):
                find_object(dictionary, path)


def test_names_may_be_shortened(dictionary: ObjectDictionary) -> None:
    """As long as only one object can be meant."""
    for path, address in (
        ('Statusword', (0x6041, 0)),
        ('Software position limit/Max', (0x607D, 2)),
        ('max position limit', (0x607D, 2)),
        ('identity object/serial number', (0x1018, 4)),
        ('vendor', (0x1018, 1)),
    ):
        assert find_object(dictionary, path).address == address


def test_what_is_not_found_is_answered_with_what_there_is(dictionary: ObjectDictionary) -> None:
    """The message helps to write it rightly."""
    for path, words in (
        ('  status  word ', 'similar: 0x6041:00 Statusword'),
        ('Contrlword', 'no object .*similar: 0x6040:00 Controlword'),
        ('position', 'may be any of .*0x6064:00 Position actual value'),
        ('0x607D:09', 'no sub-index 0x09; it has: .*0x607D:02 Max position limit'),
        ('0x9999', 'no object 0x9999 in .*cia402_drive.eds'),
        ('', 'no object is named'),
        (' / ', 'no object is named'),
    ):
        with pytest.raises(ObjectError, match=words):
            find_object(dictionary, path)


INTEGERS = [*SIGNED_BITS, *UNSIGNED_BITS]
STRUCT_CODES = {8: 'b', 16: 'h', 32: 'i', 64: 'q'}  # in capitals for those without a sign


@pytest.mark.slow
@settings(max_examples=400)
@given(data_type=st.sampled_from(INTEGERS), data=st.data(), excess=st.integers(1, 1 << 70))
def test_an_integer_survives_the_round_trip(
    data_type: DataType, data: st.DataObject, excess: int
) -> None:
    """In as many bytes as the type has; 8, 16, 32 and 64 bit are what struct makes of them.

    Every pattern is a value of its own; one beyond either end is refused, never wrapped.
    """
    low, high = integer_range(data_type) or (0, 0)
    value = data.draw(st.integers(low, high) | st.sampled_from((low, high, 0)))
    encoded = encode(data_type, value)
    size = byte_length(data_type) or 0
    assert len(encoded) == size == FIXED_BITS[data_type] // 8
    assert decode(data_type, encoded) == value
    code = STRUCT_CODES.get(FIXED_BITS[data_type], '')
    if code:
        assert encoded == struct.pack('<' + (code if low else code.upper()), value)
    pattern = data.draw(st.binary(min_size=size, max_size=size))
    assert encode(data_type, decode(data_type, pattern)) == pattern
    for beyond in (low - excess, high + excess):
        with pytest.raises(CodecError, match=data_type.name):
            encode(data_type, beyond)


@given(single=st.floats(width=32), double=st.floats())
def test_a_real64_survives_the_round_trip(single: float, double: float) -> None:
    """And a REAL32: exactly, infinities and NaN included; an overflow is refused."""
    for data_type, value in ((DataType.REAL32, single), (DataType.REAL64, double)):
        decoded = decode(data_type, encode(data_type, value))
        assert decoded == value or (math.isnan(value) and math.isnan(float(decoded)))
    for data_type, large in ((DataType.REAL32, 1e39), (DataType.REAL64, 10**400)):
        with pytest.raises(CodecError, match=data_type.name):
            encode(data_type, large)


@pytest.mark.slow
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


@given(data_type=st.sampled_from(DataType), value=VALUES, data=st.binary(max_size=12))
def test_encoding_and_decoding_fail_with_codec_error_only(
    data_type: DataType, value: Value, data: bytes
) -> None:
    """A value becomes bytes of the type's length; bytes of that length are a value."""
    expected = byte_length(data_type)
    with suppress(CodecError):
        assert expected in (None, len(encode(data_type, value)))
    if expected in (None, len(data)):
        decode(data_type, data)
    else:
        with pytest.raises(CodecError, match=data_type.name):
            decode(data_type, data)
