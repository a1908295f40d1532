# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SDO transfers in words: whole conversations as they are on the bus."""

from __future__ import annotations

from can_sample_bus import BUS, DRIVE_OBJECTS
from hypothesis import given
from hypothesis import strategies as st
import pytest

from canopen_core.can import Frame
from canopen_core.standard import sdo
from canopen_tools import FrameDescriber
from canopen_tools.monitor.sdo_follower import ObjectNames, SdoFollower

NAME = '0x1008:00 Name'
# '>' goes to the device, '<' comes from it
CONVERSATIONS = {
    'expedited read': [
        ('>', '4041600000000000', 'read 0x6041:00 Status'),
        ('<', '4b41600037160000', '0x6041:00 Status = 0x1637 Operation enabled'),
    ],
    'expedited write': [
        ('>', '2f60600001000000', 'write 0x6060:00 Mode = 1 Profile position'),
        ('<', '6060600000000000', 'accepts 0x6060:00 Mode'),
    ],
    'expedited without a size': [
        ('<', '4241600037160000', '0x6041:00 Status = 0x1637 Operation enabled')
    ],
    'a wrong length': [
        ('<', '4f41600037000000', '0x6041:00 Status = 37 (UNSIGNED16 takes 2 bytes, got 1)')
    ],
    'four bytes for a smaller object': [
        ('<', '4341600037160000', '0x6041:00 Status = 0x1637 Operation enabled'),
        ('<', '43616000fda5a5a5', '0x6061:00 Mode shown = -3 Mode -3'),
    ],
    'without its unused bytes': [
        (
            '<',
            '4b4160003716',
            '0x6041:00 Status = 0x1637 Operation enabled (6 bytes instead of 8)',
        ),
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
        (
            '<',
            '8099990000000206',
            'abort 0x9999:00: object does not exist in the object dictionary (0x06020000)',
        ),
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
        ('<', '4b41600037160000', '0x6041:00 Status = 0x1637 Operation enabled'),
    ],
    'aborted block write': [
        ('>', 'c008100000000000', f'block write {NAME}'),
        ('<', 'a0081000 7f000000', f'block write {NAME}, 127 segments a block'),
        ('>', '0140404040404040', f'block segment 1 of {NAME}'),
        ('<', '8008100004000405', f'abort {NAME}: CRC error (0x05040004)'),
        ('>', '4041600000000000', 'read 0x6041:00 Status'),
    ],
}


@pytest.mark.parametrize('name', CONVERSATIONS)
def test_a_conversation_in_words(name: str) -> None:
    """Each frame is reported with its object, and a value when it is complete."""
    describer = FrameDescriber(BUS)
    for arrow, data, text in CONVERSATIONS[name]:
        can_id = 0x602 if arrow == '>' else 0x582
        said = describer.describe(Frame(can_id, bytes.fromhex(data)))
        assert str(said) == f'SDO {arrow} joint1  {text}'


WITHOUT_EDS = [
    ('>', '4018100100000000', 'read 0x1018:01 Identity'),
    ('<', '4318100145030000', '0x1018:01 Identity = 0x00000345'),
    ('<', '4b41600037160000', '0x6041:00 Statusword = 0x1637 Operation enabled'),
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


@pytest.mark.parametrize(('arrow', 'data', 'text'), WITHOUT_EDS)
def test_standard_objects_have_names_without_an_eds(arrow: str, data: str, text: str) -> None:
    """What CiA 301 and 402 define is reported for unknown devices too."""
    can_id = 0x605 if arrow == '>' else 0x585
    said = FrameDescriber().describe(Frame(can_id, bytes.fromhex(data)))
    assert str(said) == f'SDO {arrow} node 5  {text}'


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
