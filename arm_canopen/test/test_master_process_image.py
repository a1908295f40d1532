# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The process image: where values stand, in which order they leave, and what a SYNC waits for."""

from __future__ import annotations

from dataclasses import replace
import struct

from drive_samples import drive_config, pdo, sdo_write
from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen.config import PdoConfig
from arm_canopen.master.process_image import ProcessImage, ReceivedTpdo, SyncRound
from arm_canopen.master.remote_objects import start_value
from canopen_core.can import Frame
from canopen_core.standard import DataType, is_controlword, MappedObject

CONTROLWORD, MODE, TARGET, VELOCITY = 0x6040, 0x6060, 0x607A, 0x60FF
TPDOS = (
    pdo(1, 0x182, (0x6041, 0), (0x6061, 0)),
    pdo(2, 0x282, (0x6064, 0), (0x606C, 0)),
)
RPDOS = (
    pdo(1, 0x202, (CONTROLWORD, 0), (MODE, 0)),
    pdo(2, 0x302, (TARGET, 0), (VELOCITY, 0)),
    pdo(3, 0x402, (0x60C1, 1)),
)
INT32 = st.integers(-(2**31), 2**31 - 1)


def image(
    tpdos: tuple[PdoConfig, ...] = TPDOS, rpdos: tuple[PdoConfig, ...] = RPDOS
) -> ProcessImage:
    """Return the image of a device."""
    return ProcessImage(tpdos, rpdos, SyncRound(lambda: None), send_last=is_controlword)


@given(st.integers(0, 0xFFFF), st.integers(-128, 127), INT32, INT32)
def test_values_stand_where_the_mapping_says(
    word: int, mode: int, position: int, velocity: int
) -> None:
    """Each object is found in the frame of its TPDO, signed as its type is."""
    entries = image()
    for entry in entries.tpdos:
        data = (
            struct.pack('<Hb', word, mode)
            if entry.config.number == 1
            else struct.pack('<ii', position, velocity)
        )
        entry.receive(Frame(entry.config.cob_id, data, timestamp=3.0))
        assert entry.timestamp == 3.0
    readers = [entries.reader(index) for index in (0x6041, 0x6061, 0x6064, 0x606C)]
    assert [reader and reader.value for reader in readers] == [word, mode, position, velocity]


@given(st.integers(0, 0xFFFF), INT32, INT32, INT32)
def test_what_is_written_leaves_with_the_next_frame(
    word: int, target: int, velocity: int, data: int
) -> None:
    """Each object is written to its place in its RPDO and to no other."""
    entries = image()
    for index, subindex, value in (
        (CONTROLWORD, 0, word),
        (TARGET, 0, target),
        (VELOCITY, 0, velocity),
        (0x60C1, 1, data),
    ):
        writer = entries.writer(index, subindex)
        assert writer is not None
        writer.write(value)
    frames = {output.frame().can_id: output.frame().data for output in entries.rpdos}
    assert frames == {
        0x202: struct.pack('<Hb', word, 0),
        0x302: struct.pack('<ii', target, velocity),
        0x402: struct.pack('<i', data),
    }


def test_an_object_in_several_rpdos_is_written_to_all_of_them() -> None:
    """An EDS often maps the controlword four times; a zero in one would disable the drive."""
    also = pdo(3, 0x402, (CONTROLWORD, 0), (TARGET, 0))
    entries = image(rpdos=(*RPDOS[:2], also))
    for index, value in ((CONTROLWORD, 0x0F), (TARGET, -5)):
        writer = entries.writer(index)
        assert writer is not None
        writer.write(value)
    frames = {output.frame().can_id: output.frame().data for output in entries.rpdos}
    assert frames == {
        0x202: struct.pack('<Hb', 0x0F, 0),
        0x302: struct.pack('<ii', -5, 0),
        0x402: struct.pack('<Hi', 0x0F, -5),
    }


def test_the_controlword_leaves_last() -> None:
    """A command never overtakes its data; the others keep their order."""
    assert [output.config.cob_id for output in image().rpdos] == [0x302, 0x402, 0x202]


def test_what_no_pdo_carries_has_no_place() -> None:
    """Objects that are not mapped, or only the other way, or in a disabled PDO, are not found."""
    disabled = (replace(TPDOS[0], enabled=False), replace(TPDOS[1], mapping=()))
    entries = image(disabled)
    assert entries.tpdos == []
    assert entries.reader(0x6041) is None
    assert entries.reader(CONTROLWORD) is None
    assert entries.writer(0x6041) is None
    assert entries.writer(0x60C1, 2) is None
    assert entries.commanded(0x6071) is None


def test_values_are_unknown_until_they_come_and_after_a_restart() -> None:
    """Nothing is invented: no value before the first PDO, and none after it was forgotten."""
    entries = image()
    reader = entries.reader(0x6041)
    assert reader is not None
    assert reader.value is None
    entries.tpdos[0].receive(Frame(0x182, bytes(3)))
    assert reader.value == 0
    entries.clear()
    assert reader.value is None


@pytest.mark.parametrize(('length', 'taken'), [(0, False), (2, False), (3, True), (8, True)])
def test_short_pdos_are_counted_and_long_ones_read(length: int, taken: bool) -> None:
    """A PDO of the wrong length does not change values by half (CiA 301, 7.2.2.5)."""
    entry = image().tpdos[0]
    entry.receive(Frame(0x182, b'\x37\x06\x01' + bytes(5)))
    entry.receive(Frame(0x182, (b'\x40\x02\x08' + bytes(5))[:length]))
    assert entry.values == ((0x240, 8) if taken else (0x637, 1))
    assert entry.count == 1 + taken
    assert entry.length_errors == 1 - taken


def answered(entry: ReceivedTpdo) -> None:
    """Deliver a TPDO."""
    entry.receive(Frame(entry.config.cob_id, bytes(8)))


@given(
    st.lists(
        st.tuples(st.booleans(), st.lists(st.integers(0, 3), max_size=8)), min_size=1, max_size=8
    )
)
def test_a_round_is_complete_when_its_last_answer_comes(
    rounds: list[tuple[bool, list[int]]],
) -> None:
    """Whatever comes how often: complete exactly once, and only when all that answered do again.

    TPDO 3 is of a device that sometimes gets no request, as one that is offline.
    """
    complete: list[int] = []
    sync = SyncRound(lambda: complete.append(1))
    entries = [ReceivedTpdo(replace(TPDOS[0], number=n), sync) for n in range(1, 5)]
    known: set[int] = set()
    for third_requested, arrivals in rounds:
        complete.clear()
        sync.start(0.0)
        requested = [n for n in range(4) if n != 2 or third_requested]
        for n in requested:
            entries[n].expect()
        if not third_requested:
            entries[2].awaited = False
        expected = known & set(requested)
        for count, n in enumerate(arrivals):
            answered(entries[n])
            there = set(arrivals[: count + 1])
            assert len(complete) == (bool(expected) and expected <= there)
        assert {n for n in range(4) if entries[n].awaited} == expected - set(arrivals)
        known |= set(arrivals)


def test_start_values_are_those_that_the_device_has() -> None:
    """What nobody commands keeps what bus.yml wrote, else the default of the EDS, else 0."""
    config = drive_config('joint1', 2, sdo_writes=(sdo_write(0x6081, 0, 1234),))
    velocity = MappedObject(0x6081, 0, DataType.UNSIGNED32)
    deceleration = MappedObject(0x6085, 0, DataType.UNSIGNED32)
    default = config.dictionary.get(0x6085)
    assert default is not None
    assert start_value(config, velocity) == 1234
    assert start_value(config, deceleration) == default.default != 0
    assert start_value(config, MappedObject(0x6085, 0, DataType.UNSIGNED8)) == 0
    assert start_value(config, MappedObject(0x2FFF, 0, DataType.UNSIGNED8)) == 0


def test_start_values_leave_with_the_first_frame() -> None:
    """A device whose profile velocity is mapped does not get 0."""
    config = drive_config('joint1', 2, sdo_writes=(sdo_write(0x6081, 0, 1234),))
    entries = ProcessImage(
        (),
        (pdo(2, 0x302, (TARGET, 0), (0x6081, 0)),),
        SyncRound(lambda: None),
        start=lambda mapped: start_value(config, mapped),
    )
    assert entries.rpdos[0].frame().data == struct.pack('<iI', 0, 1234)


def test_a_listener_that_ends_while_it_is_called_costs_the_others_nothing() -> None:
    """As when another thread takes it away between two calls."""
    received: list[str] = []

    def once(entry: ReceivedTpdo) -> None:
        received.append('once')
        entry.ignore(once)

    entry = ReceivedTpdo(TPDOS[0], SyncRound(lambda: None))
    entry.listen(once)
    entry.listen(lambda entry: received.append('always'))
    for _ in range(2):
        entry.receive(Frame(TPDOS[0].cob_id, bytes(8)))
    assert received == ['once', 'always', 'always']
