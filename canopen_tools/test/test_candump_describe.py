# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames in words, by table, and whole SDO conversations as they are on the bus."""

from __future__ import annotations

import re

from can_strategies import frames
from hypothesis import given
from hypothesis import strategies as st
import pytest
from tool_environment import BUS, DRIVE_OBJECTS

from canopen_core.can import Frame
from canopen_core.standard import ConsumerHeartbeatTime, sdo
from canopen_tools import Description, FrameDescriber
from canopen_tools.candump import LineFormat, TimeStyle
from canopen_tools.cli.arguments import split_ros_arguments
from canopen_tools.monitor import FrameFilter, FrameKind
from canopen_tools.monitor.sdo_follower import ObjectNames, SdoFollower

ENABLED, ENABLE = '0x1637 Operation enabled', 'Enable operation'
VENDOR = 'positioning control, vendor code'
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
    (0x182, '371601', f'TPDO1 joint1  Status={ENABLED}  Mode shown=1 Profile position'),
    (0x182, '37160100', f'TPDO1 joint1  Status={ENABLED}  Mode shown=1 Profile position'),
    (0x182, '3716', 'TPDO1 joint1  PDO of 2 bytes is shorter than its mapping (3)'),
    (0x2A5, 'f0ffffff2a', 'TPDO2 joint1  Position=-16  0x5FFF:00=42'),
    (0x202, '1f0001', f'RPDO1 joint1  Control=0x001F {ENABLE}, bit 4  Mode=1 Profile position'),
    (0x202, '0f01ff', f'RPDO1 joint1  Control=0x010F {ENABLE}, halt  Mode=-1 Mode -1'),
    (0x382, '00', 'TPDO3 joint1'),  # disabled in bus.yml, so its mapping is not to be trusted
    (0x091, '', 'SYNC'),  # where the EDS of the gripper has it
    (0x0C1, '0010010000000000', 'EMCY gripper  0x1000 generic error (register: generic)'),
    (0x082, '1086010000000000', f'EMCY joint1  0x8610 {VENDOR} (register: generic)'),
]


OTHERS = [
    (Frame(0x702, is_remote=True), 'node guard joint1  state requested'),
    (Frame(0x182, is_remote=True), 'TPDO1 joint1  requested'),
    (Frame(0x185, is_remote=True), 'TPDO1 node 5  requested'),
    (Frame(0x080, is_remote=True), 'SYNC  requested'),
    (Frame(0x182, b'\1', is_extended=True), 'unknown  29-bit identifier'),
    (Frame(0x040, bytes(8), is_error=True), 'CAN error  bus off'),
]
"""Requests say what is wanted, error frames what happened."""


def test_every_service_has_words() -> None:
    """By the pre-defined connection set; devices, objects and COB-IDs by bus.yml and EDS."""
    for config, frame, text in (
        *((None, Frame(can_id, bytes.fromhex(data)), text) for can_id, data, text in GENERIC),
        *((BUS, Frame(can_id, bytes.fromhex(data)), text) for can_id, data, text in NAMED),
        *((BUS, frame, text) for frame, text in OTHERS),
    ):
        assert str(FrameDescriber(config).describe(frame)) == text


def test_kinds_and_alerts() -> None:
    """Each frame has its service, and what is wrong is marked."""
    for can_id, data, kind, is_alert in (
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
    ):
        said = FrameDescriber(BUS).describe(Frame(can_id, bytes.fromhex(data)))
        assert (said.kind, said.is_alert) == (kind, is_alert), (can_id, data)


sdo_frames = st.builds(Frame, st.sampled_from([0x602, 0x582]), st.binary(min_size=8, max_size=8))


@given(
    st.one_of(st.lists(frames(), max_size=30), st.lists(sdo_frames, max_size=60)), st.booleans()
)
def test_no_frame_is_an_error(sent: list[Frame], with_config: bool) -> None:
    """Whatever is on the bus in whatever order, it gets one line of text.

    A monitor comes in at any moment, so segments without a start are normal.
    """
    describer = FrameDescriber(BUS if with_config else None)
    for frame in sent:
        said = str(describer.describe(frame))
        assert said
        assert said.splitlines() == [said]


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


def test_terms_choose_frames() -> None:
    """Positive terms add up, negative ones take away, none shows all."""
    for terms, shown in (
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
    ):
        describer, chosen = FrameDescriber(BUS), FrameFilter(terms)
        seen = {
            name
            for name, frame in FRAMES.items()
            if chosen.shows(frame, describer.describe(frame))
        }
        assert seen == shown, terms


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


def test_time_styles() -> None:
    """Times are absolute, since the first line, since the line before, or left out."""
    for style, times in (
        (TimeStyle.ABSOLUTE, ['(1700000010.500000) ', '(1700000012.000000) ']),
        (TimeStyle.ZERO, ['(0000.000000) ', '(0001.500000) ']),
        (TimeStyle.DELTA, ['(0000.000000) ', '(0001.250000) ']),
        (TimeStyle.NONE, ['', '']),
    ):
        first, _, last = lines(style, 10.5, 10.75, 12.0)
        rest = '     181  [2]  27 06                    TPDO1      joint1     Status=0'
        assert [first, last] == [time + rest for time in times], style


def test_the_columns_stay_where_they_are() -> None:
    """For every kind of frame; the date is local time to the microsecond."""
    formatted = LineFormat(TimeStyle.NONE, 0.0)
    extended = formatted.line(Frame(0x181, b'\1', is_extended=True), SAID)
    remote = formatted.line(Frame(0x701, is_remote=True), SAID)
    assert extended.startswith('00000181  [1]  01   ')
    assert remote.startswith('     701  [0]  remote request   ')
    assert extended.index('TPDO1') == remote.index('TPDO1')
    (text,) = lines(TimeStyle.DATE, 0.25)
    assert re.match(r'\(2023-11-1[3-5] \d\d:\d\d:20\.250000\) ', text)


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


def test_ros_arguments_are_taken_out() -> None:
    """What is for ROS ends at `--` or at the end; the rest is the program's own."""
    for line, own, parameters in (
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
    ):
        assert split_ros_arguments(line.split()) == (own.split(), parameters), line


@pytest.mark.parametrize('line', ['--ros-args -p', '--ros-args -p a', '--ros-args -p :=1'])
def test_a_parameter_without_name_or_value_is_refused(line: str) -> None:
    """A forgotten half is reported, as rcl does."""
    with pytest.raises(ValueError, match=r'needs a value|not a parameter'):
        split_ros_arguments(line.split())


@pytest.mark.parametrize('word', [0, 0x0001_0000, 0x0000_0064, 0x0080_0064, 0x00FF_0064])
def test_an_entry_that_is_not_used(word: int) -> None:
    """Time 0, node id 0 or above 127 (CiA 301, 7.5.2.17)."""
    assert not ConsumerHeartbeatTime.parse(word).used


NAME, STATUS = '0x1008:00 Name', '0x6041:00 Status'
NO_OBJECT = 'object does not exist in the object dictionary'
# '>' goes to the device, '<' comes from it
CONVERSATIONS = {
    'expedited read': [
        ('>', '4041600000000000', 'read 0x6041:00 Status'),
        ('<', '4b41600037160000', f'0x6041:00 Status = {ENABLED}'),
    ],
    'expedited write': [
        ('>', '2f60600001000000', 'write 0x6060:00 Mode = 1 Profile position'),
        ('<', '6060600000000000', 'accepts 0x6060:00 Mode'),
    ],
    'expedited without a size': [('<', '4241600037160000', f'0x6041:00 Status = {ENABLED}')],
    'a wrong length': [
        ('<', '4f41600037000000', '0x6041:00 Status = 37 (UNSIGNED16 takes 2 bytes, got 1)')
    ],
    'four bytes for a smaller object': [
        ('<', '4341600037160000', f'0x6041:00 Status = {ENABLED}'),
        ('<', '43616000fda5a5a5', '0x6061:00 Mode shown = -3 Mode -3'),
    ],
    'without its unused bytes': [
        ('<', '4b4160003716', f'{STATUS} = {ENABLED} (6 bytes instead of 8)'),
        ('<', '60606000', 'accepts 0x6060:00 Mode (4 bytes instead of 8)'),
        ('<', '4b416000', 'an SDO frame has 8 bytes, got 4'),
    ],
    'real number': [('<', '437560000000c03f', '0x6075:00 Motor rated current = 1.5')],
    'PDO configuration': [
        ('>', '2300180182010080', 'write 0x1800:01 COB-ID used by TPDO = 0x182 disabled'),
        ('>', '23001a0110004160', 'write 0x1A00:01 1st object = 0x6041:00 (16 bit)'),
        ('>', '2f0018020a000000', 'write 0x1800:02 TPDO1 communication = 10'),
    ],
    'abort': [
        ('>', '4099990000000000', 'read 0x9999:00'),
        ('<', '8099990000000206', f'abort 0x9999:00: {NO_OBJECT} (0x06020000)'),
    ],
    'abort by the client': [
        ('>', '8041600000000405', 'abort 0x6041:00 Status: SDO protocol timed out (0x05040000)')
    ],
    'segmented read': [
        ('>', '4008100000000000', f'read {NAME}'),
        ('<', '410810000a000000', f'{NAME}, 10 bytes in segments'),
        ('>', '6000000000000000', f'next segment of {NAME}'),
        ('<', '0053696d756c6174', f'segment of {NAME}, 7 bytes (7 of 10)'),
        ('>', '7000000000000000', f'next segment of {NAME}'),
        ('<', '1965647800000000', f'last segment, {NAME} = "Simulatedx"'),
    ],
    'text that would steer the terminal': [('<', '430810000a1b5b4a', f'{NAME} = "\\n\\x1b[J"')],
    'segmented write without a size': [
        ('>', '2008100000000000', f'write {NAME} in segments'),
        ('<', '6008100000000000', f'accepts {NAME}'),
        ('>', '0b41420000000000', f'last segment, {NAME} = "AB"'),
        ('<', '2000000000000000', 'segment taken'),
    ],
    'in the middle': [
        ('<', '0053696d756c6174', 'segment of a transfer whose start was not seen, 7 bytes'),
        ('>', '7000000000000000', 'next segment'),
    ],
    'too short': [
        ('<', '4b4160', 'an SDO frame has 8 bytes, got 3'),
        ('>', '', 'an SDO frame has 8 bytes, got 0'),
    ],
    'no such command': [
        ('>', 'e000000000000000', 'SDO client command specifier 7 is not supported'),
        ('<', 'e000000000000000', 'SDO server command specifier 7 is not supported'),
    ],
    'block write': [
        ('>', 'c2081000 10000000', f'block write {NAME}, 16 bytes'),
        ('<', 'a008100002000000', f'block write {NAME}, 2 segments a block'),
        ('>', '0140404040404040', f'block segment 1 of {NAME}'),
        ('>', '0240404040404040', f'block segment 2 of {NAME}'),
        ('<', 'a202020000000000', 'block taken up to segment 2, 2 segments next'),
        ('>', '8140400000000000', f'last block segment 1 of {NAME}'),
        ('<', 'a201020000000000', 'block taken up to segment 1, 2 segments next'),
        ('>', 'd500000000000000', f'end of block write {NAME}'),
        ('<', 'a100000000000000', f'accepts block write {NAME}'),
        ('>', '4041600000000000', 'read 0x6041:00 Status'),
    ],
    'block read with a lost segment': [
        ('>', 'a0081000 02000000', f'block read {NAME}, 2 segments a block'),
        ('<', 'c208100009000000', f'block read {NAME}, 9 bytes'),
        ('>', 'a300000000000000', f'start block read {NAME}'),
        ('<', '0140404040404040', f'block segment 1 of {NAME}'),
        ('<', '8240400000000000', f'last block segment 2 of {NAME}'),
        ('>', 'a201020000000000', 'block taken up to segment 1, 2 segments next'),
        ('<', '8140400000000000', f'last block segment 1 of {NAME}'),
        ('>', 'a201020000000000', 'block taken up to segment 1, 2 segments next'),
        ('<', 'd500000000000000', f'end of block read {NAME}'),
        ('>', 'a100000000000000', f'end of block read {NAME}'),
        ('<', '4b41600037160000', f'0x6041:00 Status = {ENABLED}'),
    ],
    'aborted block write': [
        ('>', 'c008100000000000', f'block write {NAME}'),
        ('<', 'a0081000 7f000000', f'block write {NAME}, 127 segments a block'),
        ('>', '0140404040404040', f'block segment 1 of {NAME}'),
        ('<', '8008100004000405', f'abort {NAME}: CRC error (0x05040004)'),
        ('>', '4041600000000000', 'read 0x6041:00 Status'),
    ],
}


WITHOUT_EDS = [
    ('>', '4018100100000000', 'read 0x1018:01 Identity'),
    ('<', '4318100145030000', '0x1018:01 Identity = 0x00000345'),
    ('<', '4b41600037160000', f'0x6041:00 Statusword = {ENABLED}'),
    ('<', '43646000f0ffffff', '0x6064:00 Position actual = -16'),
    ('<', '4b3f600011860000', '0x603F:00 Error code = 0x8611 following error'),
    ('<', '4f01100011000000', '0x1001:00 Error register = 0x11 generic, communication'),
    ('<', '4303100111860000', '0x1003:01 Predefined error field = 0x8611 following error'),
    ('>', '23161001c8000100', 'write 0x1016:01 Consumer heartbeat = node 1, 200 ms'),
    ('>', '2300140105020080', 'write 0x1400:01 RPDO1 communication = 0x205 disabled'),
    ('>', '2f011a0002000000', 'write 0x1A01:00 TPDO2 mapping = 2'),
    ('<', '4700200001020300', '0x2000:00 = 01 02 03'),
    ('<', '4300200001020304', '0x2000:00 = 67305985'),
    ('<', '42002000 01000000', '0x2000:00 = 1'),
]
"""What CiA 301 and 402 define is reported for unknown devices too."""


@pytest.mark.parametrize('name', [*CONVERSATIONS, None])
def test_a_conversation_in_words(name: str | None) -> None:
    """Each frame is reported with its object, and a value when it is complete."""
    node, device = (2, 'joint1') if name else (5, 'node 5')
    describer = FrameDescriber(BUS if name else None)
    for arrow, data, text in CONVERSATIONS[name] if name else WITHOUT_EDS:
        can_id = (0x600 if arrow == '>' else 0x580) + node
        said = describer.describe(Frame(can_id, bytes.fromhex(data)))
        assert str(said) == f'SDO {arrow} {device}  {text}'


def test_transfers_of_different_devices_are_kept_apart() -> None:
    """The segments of two devices that are read at the same time do not mix."""
    describer = FrameDescriber()
    texts = []
    for can_id, data in [
        (0x585, '4108100003000000'),
        (0x586, '4108100003000000'),
        (0x585, '0941424300000000'),
        (0x586, '0944454600000000'),
    ]:
        texts.append(describer.describe(Frame(can_id, bytes.fromhex(data))).text)
    assert texts[2].endswith('= 41 42 43')
    assert texts[3].endswith('= 44 45 46')


@given(st.text(st.characters(min_codepoint=33, max_codepoint=126), min_size=5, max_size=100))
def test_a_segmented_value_is_put_together(name: str) -> None:
    """Read or written, the last segment shows the whole value."""
    content = name.encode()
    parts = [content[at : at + 7] for at in range(0, len(content), 7)]
    reading, writing = (SdoFollower(ObjectNames(DRIVE_OBJECTS)) for _ in range(2))
    reading.request(sdo.UploadRequest(0x1008, 0).encode())
    reading.response(sdo.UploadResponse(0x1008, 0, None, len(content)).encode())
    writing.request(sdo.DownloadRequest(0x1008, 0, None, len(content)).encode())
    writing.response(sdo.DownloadResponse(0x1008, 0).encode())
    for number, part in enumerate(parts):
        toggle, last = bool(number % 2), number == len(parts) - 1
        segment = sdo.Segment(toggle, part, last).encode()
        reading.request(sdo.UploadSegmentRequest(toggle).encode())
        read = reading.response(segment).text
        written = writing.request(segment).text
        writing.response(sdo.DownloadSegmentResponse(toggle).encode())
    assert read == written == f'last segment, {NAME} = "{name}"'
