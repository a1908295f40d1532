# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames in words, by table: with a bus.yml and without one."""

from __future__ import annotations

import re

from can_sample_bus import BUS
from can_strategies import frames
from hypothesis import given
from hypothesis import strategies as st
import pytest

from canopen_core.can import Frame
from canopen_core.standard import ConsumerHeartbeatTime
from canopen_tools import Description, FrameDescriber
from canopen_tools.candump import LineFormat, TimeStyle
from canopen_tools.cli.arguments import split_ros_arguments
from canopen_tools.monitor import FrameFilter, FrameKind
from canopen_tools.monitor.sdo_follower import value_text

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
    (0x082, '3023010000000000', 'EMCY node 2  0x2330 earth leakage at output (register: generic)'),
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
    (0x77F, '0505', 'heartbeat node 127  unknown state 05 05'),
    (0x001, '01', 'unknown'),
    (0x180, '01', 'unknown'),
    (0x7FF, '01', 'unknown'),
]

NAMED = [
    (0x000, '0102', 'NMT joint1  start'),
    (0x701, '05', 'heartbeat master  operational'),
    (0x702, '00', 'boot-up joint1'),
    (0x703, '00', 'boot-up node 3'),
    (
        0x182,
        '371601',
        'TPDO1 joint1  Status=0x1637 Operation enabled  Mode shown=1 Profile position',
    ),
    (
        0x182,
        '37160100',
        'TPDO1 joint1  Status=0x1637 Operation enabled  Mode shown=1 Profile position',
    ),
    (0x182, '3716', 'TPDO1 joint1  PDO of 2 bytes is shorter than its mapping (3)'),
    (0x2A5, 'f0ffffff2a', 'TPDO2 joint1  Position=-16  0x5FFF:00=42'),
    (
        0x202,
        '1f0001',
        'RPDO1 joint1  Control=0x001F Enable operation, bit 4  Mode=1 Profile position',
    ),
    (0x202, '0f01ff', 'RPDO1 joint1  Control=0x010F Enable operation, halt  Mode=-1 Mode -1'),
    (0x382, '00', 'TPDO3 joint1'),  # disabled in bus.yml, so its mapping is not to be trusted
    (0x091, '', 'SYNC'),  # where the EDS of the gripper has it
    (0x0C1, '0010010000000000', 'EMCY gripper  0x1000 generic error (register: generic)'),
    (
        0x082,
        '1086010000000000',
        'EMCY joint1  0x8610 positioning control, vendor code (register: generic)',
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
        (Frame(0x702, is_remote=True), 'node guard joint1  state requested'),
        (Frame(0x182, is_remote=True), 'TPDO1 joint1  requested'),
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


FRAMES = {
    'nmt': Frame(0x000, b'\x01\x02'),
    'sync': Frame(0x080),
    'emcy': Frame(0x082, bytes(8)),
    'tpdo': Frame(0x182, bytes(3)),
    'sdo': Frame(0x602, bytes(8)),
    'heartbeat': Frame(0x702, b'\x05'),
    'other heartbeat': Frame(0x709, b'\x05'),
    'extended': Frame(0x0001_0182, is_extended=True),
}


@pytest.mark.parametrize(
    ('terms', 'shown'),
    [
        ([], set(FRAMES)),
        ([''], set(FRAMES)),
        (['sdo'], {'sdo'}),
        (['SDO', 'emcy'], {'sdo', 'emcy'}),
        (['sdo, emcy'], {'sdo', 'emcy'}),
        (['^sync,^heartbeat'], {'nmt', 'emcy', 'tpdo', 'sdo', 'extended'}),
        (['heartbeat', '^node:gripper'], {'heartbeat'}),
        (['node:joint1'], {'nmt', 'emcy', 'tpdo', 'sdo', 'heartbeat'}),
        (['node:9'], {'other heartbeat'}),
        (['node:nobody'], set()),
        (['182'], {'tpdo'}),
        (['0x182'], {'tpdo'}),
        (['700:780'], {'heartbeat', 'other heartbeat'}),
        (['182:7FF'], {'tpdo', 'extended'}),
        (['10182'], {'extended'}),
    ],
)
def test_terms_choose_frames(terms: list[str], shown: set[str]) -> None:
    """Positive terms add up, negative ones take away, none shows all."""
    describer, chosen = FrameDescriber(BUS), FrameFilter(terms)
    seen = {
        name for name, frame in FRAMES.items() if chosen.shows(frame, describer.describe(frame))
    }
    assert seen == shown


@pytest.mark.parametrize('term', ['tpdos', '18x', '180:', ':7FF', '^', '^foo', '123456789'])
def test_a_wrong_term_lists_what_would_be_right(term: str) -> None:
    """A typing mistake is not silently a filter that shows nothing."""
    with pytest.raises(ValueError, match=r'unknown filter .*; choose one of nmt, .*180:780'):
        FrameFilter([term])


SAID = Description(FrameKind.PDO, 'TPDO1', 'joint1', 'Status=0')
OFFSET = 1_700_000_000.0  # [s]


def lines(style: TimeStyle, *stamps: float) -> list[str]:
    """Format frames of these times."""
    formatted = LineFormat(style, OFFSET)
    return [formatted.line(Frame(0x181, b'\x27\x06', stamp), SAID) for stamp in stamps]


@pytest.mark.parametrize(
    ('style', 'times'),
    [
        (
            TimeStyle.ABSOLUTE,
            ['(1700000010.500000) ', '(1700000010.750000) ', '(1700000012.000000) '],
        ),
        (TimeStyle.ZERO, ['(0000.000000) ', '(0000.250000) ', '(0001.500000) ']),
        (TimeStyle.DELTA, ['(0000.000000) ', '(0000.250000) ', '(0001.250000) ']),
        (TimeStyle.NONE, ['', '', '']),
    ],
)
def test_time_styles(style: TimeStyle, times: list[str]) -> None:
    """Times are absolute, since the first line, since the line before, or left out."""
    texts = lines(style, 10.5, 10.75, 12.0)
    rest = '     181  [2]  27 06                    TPDO1      joint1     Status=0'
    assert texts == [time + rest for time in times]


def test_the_date_is_local_time() -> None:
    """Date and time to the microsecond, whatever the time zone."""
    (text,) = lines(TimeStyle.DATE, 0.25)
    assert re.match(r'\(2023-11-1[3-5] \d\d:\d\d:20\.250000\) ', text)


def test_29_bits_and_remote_requests_have_their_columns() -> None:
    """The columns stay where they are for every kind of frame."""
    formatted = LineFormat(TimeStyle.NONE, 0.0)
    extended = formatted.line(Frame(0x181, b'\1', is_extended=True), SAID)
    remote = formatted.line(Frame(0x701, is_remote=True), SAID)
    assert extended.startswith('00000181  [1]  01   ')
    assert remote.startswith('     701  [0]  remote request   ')
    assert extended.index('TPDO1') == remote.index('TPDO1')


def test_colors_paint_the_meaning_and_alerts_are_red() -> None:
    """Escape codes appear only on request, and end with the line."""
    alert = Description(FrameKind.EMCY, 'EMCY', 'joint1', 'over current', is_alert=True)
    plain = LineFormat(TimeStyle.NONE, 0.0)
    colored = LineFormat(TimeStyle.NONE, 0.0, color=True)
    frame = Frame(0x81, bytes(8))
    assert '\x1b' not in plain.line(frame, alert)
    assert '\x1b[1;31mEMCY' in colored.line(frame, alert)
    assert colored.line(frame, alert).endswith('over current\x1b[0m')
    assert '\x1b[36mTPDO1' in colored.line(frame, SAID)


@pytest.mark.parametrize(
    ('line', 'own', 'parameters'),
    [
        ('', '', {}),
        ('vcan0 -n 3', 'vcan0 -n 3', {}),
        ('vcan0 --ros-args', 'vcan0', {}),
        ('--ros-args -p a:=1', '', {'a': '1'}),
        ('--ros-args --param a:=1 -p b:=x:y -- vcan0', 'vcan0', {'a': '1', 'b': 'x:y'}),
        ('--ros-args -p candump:a:=1', '', {'a': '1'}),
        ('--ros-args -p a:=', '', {'a': ''}),
        ('--ros-args -r __node:=x --log-level debug --params-file f.yaml -p a:=1', '', {'a': '1'}),
        ('--ros-args --disable-stdout-logs -p a:=1', '', {'a': '1'}),
        ('-n 3 --ros-args -p a:=1 -- -t a --ros-args -p b:=2', '-n 3 -t a', {'a': '1', 'b': '2'}),
        ('-p 3', '-p 3', {}),
    ],
)
def test_ros_arguments_are_taken_out(line: str, own: str, parameters: dict[str, str]) -> None:
    """What is for ROS ends at `--` or at the end; the rest is the program's own."""
    arguments = split_ros_arguments(line.split())
    assert arguments.own == own.split()
    assert arguments.parameters == parameters


@pytest.mark.parametrize('line', ['--ros-args -p', '--ros-args -p a', '--ros-args -p :=1'])
def test_a_parameter_without_name_or_value_is_refused(line: str) -> None:
    """A forgotten half is reported, as rcl does."""
    with pytest.raises(ValueError, match=r'needs a value|not a parameter'):
        split_ros_arguments(line.split())


@given(st.integers(1, 127), st.integers(1, 0xFFFF))
def test_what_is_written_is_read(node_id: int, time_ms: int) -> None:
    """Node id in bits 16 to 23, time in bits 0 to 15."""
    entry = ConsumerHeartbeatTime(node_id, time_ms)
    assert ConsumerHeartbeatTime.parse(entry.word) == entry
    assert entry.used
    assert value_text(0x1016, 1, entry.word).startswith(f'node {node_id}, {time_ms} ms')


@pytest.mark.parametrize('word', [0, 0x0001_0000, 0x0000_0064, 0x0080_0064, 0x00FF_0064])
def test_an_entry_that_is_not_used(word: int) -> None:
    """Time 0, node id 0 or above 127 (CiA 301, 7.5.2.17)."""
    assert not ConsumerHeartbeatTime.parse(word).used


def test_bit_23_belongs_to_the_node_id() -> None:
    """An entry for id 129, which there is not, is not that of node 1."""
    assert ConsumerHeartbeatTime.parse(0x0081_0064).node_id != 1
