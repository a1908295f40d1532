# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The process image: where values stand, in which order they leave, and what a SYNC waits for."""

from __future__ import annotations

from dataclasses import replace
import struct

from drive_samples import drive_config, pdo, sdo_write
from hypothesis import given
from hypothesis import strategies as st

from arm_canopen.config import PdoConfig
from arm_canopen.master.process_image import ProcessImage, ReceivedTpdo, SyncRound
from arm_canopen.master.remote_objects import start_value
from canopen_core.can import Frame
from canopen_core.standard import DataType, is_controlword, MappedObject

CONTROLWORD, MODE, TARGET, VELOCITY = 0x6040, 0x6060, 0x607A, 0x60FF
TPDOS = (pdo(1, 0x182, (0x6041, 0), (0x6061, 0)), pdo(2, 0x282, (0x6064, 0), (0x606C, 0)))
RPDOS = (
    pdo(1, 0x202, (CONTROLWORD, 0), (MODE, 0)),
    pdo(2, 0x302, (TARGET, 0), (VELOCITY, 0)),
    pdo(3, 0x402, (0x60C1, 1)),
)


def image(
    tpdos: tuple[PdoConfig, ...] = TPDOS, rpdos: tuple[PdoConfig, ...] = RPDOS
) -> ProcessImage:
    """Return the image of a device."""
    return ProcessImage(tpdos, rpdos, SyncRound(lambda: None), send_last=is_controlword)


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
    """What is not commanded keeps what bus.yml wrote, else the default of the EDS, else 0."""
    config = drive_config('joint1', 2, sdo_writes=(sdo_write(0x6081, 0, 1234),))
    deceleration = MappedObject(0x6085, 0, DataType.UNSIGNED32)
    default = config.dictionary.number(0x6085)
    assert start_value(config, deceleration) == default != 0
    assert start_value(config, MappedObject(0x6085, 0, DataType.UNSIGNED8)) == 0
    assert start_value(config, MappedObject(0x2FFF, 0, DataType.UNSIGNED8)) == 0
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
