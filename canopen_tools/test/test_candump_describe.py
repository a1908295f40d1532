# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames in words, by table: with a bus.yml and without one."""

from __future__ import annotations

from can_sample_bus import BUS
from can_strategies import frames
from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen.can import Frame
from canopen_tools.monitor import FrameDescriber, FrameKind

GENERIC = [
    (0x000, '0102', 'NMT node 2  start'),
    (0x000, '8000', 'NMT all nodes  enter pre operational'),
    (0x000, '8105', 'NMT node 5  reset node'),
    (0x000, '8205', 'NMT node 5  reset communication'),
    (0x000, '7701', 'NMT node 1  unknown command 0x77'),
    (0x000, '01', 'NMT  no valid command'),
    (0x000, '0180', 'NMT  no valid command'),
    (0x080, '', 'SYNC'),
    (0x080, '07', 'SYNC  counter 7'),
    (0x082, '0000000000000000', 'EMCY node 2  0x0000 no error (register: none)'),
    (
        0x082,
        '3023010000000000',
        'EMCY node 2  0x2330 earth leakage at output (register: generic)',
    ),
    (0x082, '1081', 'EMCY node 2  an EMCY message has 8 bytes, got 2'),
    (0x100, 'fcce38000100', 'TIME  1984-01-02 01:02:03.004'),
    (0x100, '00', 'TIME  no time of day: it has 6 bytes, got 1'),
    (0x185, '27060000', 'TPDO1 node 5'),
    (0x57F, '00', 'RPDO4 node 127'),
    (0x705, '00', 'boot-up node 5'),
    (0x705, '05', 'heartbeat node 5  operational'),
    (0x705, '85', 'heartbeat node 5  operational'),
    (0x705, '7f', 'heartbeat node 5  pre-operational'),
    (0x705, '04', 'heartbeat node 5  stopped'),
    (0x705, '33', 'heartbeat node 5  unknown state 33'),
    (0x705, '', 'heartbeat node 5  unknown state'),
    (0x7E5, '0401000000000000', 'LSS >  switch state global'),
    (0x7E4, '4f00000000000000', 'LSS <  identify slave'),
    (0x7E5, 'ff', 'LSS >  unknown command 0xFF'),
    (0x7E5, '', 'LSS >  empty message'),
    (0x77F, '0505', 'heartbeat node 127  unknown state 05 05'),
    (0x001, '01', 'unknown'),
    (0x180, '01', 'unknown'),
    (0x7FF, '01', 'unknown'),
]

NAMED = [
    (0x000, '0102', 'NMT panda_joint1  start'),
    (0x701, '05', 'heartbeat master  operational'),
    (0x702, '00', 'boot-up panda_joint1'),
    (0x703, '00', 'boot-up node 3'),
    (
        0x182,
        '371601',
        (
            'TPDO1 panda_joint1  Statusword=0x1637 Operation enabled  '
            'Modes of operation display=1 Profile position'
        ),
    ),
    (
        0x182,
        '37160100',
        (
            'TPDO1 panda_joint1  Statusword=0x1637 Operation enabled  '
            'Modes of operation display=1 Profile position'
        ),
    ),
    (0x182, '3716', 'TPDO1 panda_joint1  PDO of 2 bytes is shorter than its mapping (3)'),
    (0x2A5, 'f0ffffff2a', 'TPDO2 panda_joint1  Position actual value=-16  0x5FFF:00=42'),
    (
        0x202,
        '1f0001',
        (
            'RPDO1 panda_joint1  Controlword=0x001F Enable operation, bit 4  '
            'Modes of operation=1 Profile position'
        ),
    ),
    (
        0x202,
        '0f01ff',
        (
            'RPDO1 panda_joint1  Controlword=0x010F Enable operation, halt  '
            'Modes of operation=-1 Mode -1'
        ),
    ),
    (
        0x382,
        '00',
        'TPDO3 panda_joint1',
    ),  # disabled in bus.yml, so its mapping is not to be trusted
    (0x091, '', 'SYNC'),  # where the EDS of the gripper has it
    (0x0C1, '0010010000000000', 'EMCY gripper  0x1000 generic error (register: generic)'),
    (
        0x082,
        '1086010000000000',
        'EMCY panda_joint1  0x8610 positioning control, vendor code (register: generic)',
    ),
]


@pytest.mark.parametrize(('can_id', 'data', 'text'), GENERIC)
def test_every_service_has_words_without_a_configuration(
    can_id: int, data: str, text: str
) -> None:
    """The pre-defined connection set says what a frame is, and numbers stand for names."""
    assert str(FrameDescriber().describe(Frame(can_id, bytes.fromhex(data)))) == text


@pytest.mark.parametrize(('can_id', 'data', 'text'), NAMED)
def test_a_configuration_gives_names_and_values(can_id: int, data: str, text: str) -> None:
    """Devices, objects and COB-IDs are those of bus.yml and EDS."""
    assert str(FrameDescriber(BUS).describe(Frame(can_id, bytes.fromhex(data)))) == text


@pytest.mark.parametrize(
    ('frame', 'text'),
    [
        (Frame(0x702, is_remote=True), 'node guard panda_joint1  state requested'),
        (Frame(0x182, is_remote=True), 'TPDO1 panda_joint1  requested'),
        (Frame(0x185, is_remote=True), 'TPDO1 node 5  requested'),
        (Frame(0x080, is_remote=True), 'SYNC  requested'),
        (Frame(0x182, b'\1', is_extended=True), 'unknown  29-bit identifier'),
        (Frame(0x040, bytes(8), is_error=True), 'CAN error  bus off'),
    ],
)
def test_other_kinds_of_frames(frame: Frame, text: str) -> None:
    """Requests say what is wanted, 29-bit frames are nobody's, error frames say what happened."""
    assert str(FrameDescriber(BUS).describe(frame)) == text


@pytest.mark.parametrize(
    ('can_id', 'data', 'kind', 'is_alert'),
    [
        (0x082, '3023010000000000', FrameKind.EMCY, True),
        (0x082, '0000000000000000', FrameKind.EMCY, False),
        (0x182, '371601', FrameKind.PDO, False),
        (0x182, '37', FrameKind.PDO, True),
        (0x582, '8041600000000206', FrameKind.SDO, True),
        (0x582, '4b41600037160000', FrameKind.SDO, False),
        (0x702, '05', FrameKind.HEARTBEAT, False),
        (0x000, '05', FrameKind.NMT, True),
        (0x100, '', FrameKind.TIME, False),
        (0x7E5, '04', FrameKind.LSS, False),
        (0x7FF, '04', FrameKind.OTHER, False),
    ],
)
def test_kinds_and_alerts(can_id: int, data: str, kind: FrameKind, is_alert: bool) -> None:
    """Each frame has its service, and what is wrong is marked."""
    said = FrameDescriber(BUS).describe(Frame(can_id, bytes.fromhex(data)))
    assert (said.kind, said.is_alert) == (kind, is_alert)


@given(st.lists(frames(), max_size=30), st.booleans())
def test_no_frame_is_an_error(sent: list[Frame], with_config: bool) -> None:
    """Whatever is on the bus in whatever order, it gets one line of text."""
    describer = FrameDescriber(BUS if with_config else None)
    for frame in sent:
        said = str(describer.describe(frame))
        assert said
        assert said.splitlines() == [said]


@given(
    st.lists(
        st.tuples(st.sampled_from([0x602, 0x582]), st.binary(min_size=8, max_size=8)), max_size=60
    )
)
def test_no_order_of_sdo_frames_is_an_error(sent: list[tuple[int, bytes]]) -> None:
    """A monitor comes in at any moment, so segments without a start are normal."""
    describer = FrameDescriber(BUS)
    for can_id, data in sent:
        assert describer.describe(Frame(can_id, data)).kind is FrameKind.SDO
