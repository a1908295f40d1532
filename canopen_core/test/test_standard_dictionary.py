# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of the object dictionary and of the pre-defined COB-IDs."""

from itertools import product

from hypothesis import given
from hypothesis import strategies as st
import pytest

from canopen_core.standard import (
    AccessType,
    DataType,
    NODE_ID_MAX,
    NODE_ID_MIN,
    ObjectDictionary,
    ObjectEntry,
    rpdo_default,
    tpdo_default,
)

pytestmark = pytest.mark.slow

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


@given(entries=ENTRIES)
def test_entries_are_ascending_and_the_later_counts(entries: list[ObjectEntry]) -> None:
    """Iteration is by index and sub-index; of two with one address the last one given is kept."""
    dictionary = ObjectDictionary(entries)
    addresses = [entry.address for entry in dictionary]
    assert addresses == sorted({entry.address for entry in entries})
    latest = {entry.address: entry for entry in entries}
    assert all(dictionary.get(*address) is latest[address] for address in addresses)


@given(entries=ENTRIES)
def test_all_ways_to_look_up_agree(entries: list[ObjectEntry]) -> None:
    """``in``, ``get``, ``has_index``, ``subindices`` and ``len`` say the same."""
    dictionary = ObjectDictionary(entries)
    assert len(dictionary) == len(list(dictionary))
    for index in range(0x1000, 0x1012):
        parts = dictionary.subindices(index)
        assert dictionary.has_index(index) == bool(parts)
        for subindex in range(5):
            entry = dictionary.get(index, subindex)
            assert ((index, subindex) in dictionary) == (entry is not None)
            assert (entry in parts) == (entry is not None)


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


@pytest.mark.parametrize(
    ('access', 'tpdo', 'rpdo'),
    [
        (AccessType.READ_ONLY, True, False),
        (AccessType.CONSTANT, True, False),
        (AccessType.WRITE_ONLY, False, True),
        (AccessType.READ_WRITE, True, True),
        (AccessType.READ_WRITE_TPDO, True, False),
        (AccessType.READ_WRITE_RPDO, False, True),
    ],
)
def test_access_decides_the_direction_of_mapping(
    access: AccessType, tpdo: bool, rpdo: bool
) -> None:
    """An object goes into the PDOs that its access allows, if it may be mapped at all."""
    entry = ObjectEntry(0x2000, 0, 'x', DataType.UNSIGNED8, access, pdo_mappable=True)
    assert (entry.tpdo_mappable, entry.rpdo_mappable) == (tpdo, rpdo)
    hidden = ObjectEntry(0x2000, 0, 'x', DataType.UNSIGNED8, access)
    assert not hidden.tpdo_mappable
    assert not hidden.rpdo_mappable


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


@pytest.mark.parametrize(
    ('address', 'literal', 'file_node_id', 'cob_id'),
    [
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
    ],
)
def test_a_cob_id_of_another_node_id_is_that_of_the_device(
    address: tuple[int, int], literal: int, file_node_id: int | None, cob_id: int
) -> None:
    """Where the file leaves out ``$NODEID``; what it means is kept, and so is the value itself."""
    written = ObjectEntry(*address, 'COB-ID', DataType.UNSIGNED32, default=literal)
    (entry,) = ObjectDictionary([written], node_id=file_node_id).for_node(3)
    assert entry.default == cob_id
    assert entry.literal == (None if cob_id == literal else literal)
