# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SDO server: transcripts byte by byte, and every reason to abort."""

from __future__ import annotations

from binascii import crc_hqx
from dataclasses import replace
import struct

from device_rig import NODE_ID, Rig
from drive_samples import drive_dictionary
from hypothesis import given
from hypothesis import strategies as st
import pytest

from canopen_core.can import Frame
from canopen_core.standard import (
    AbortCode,
    AccessType,
    COB_ID_INVALID,
    DataType,
    ObjectDictionary,
    ObjectEntry,
    sdo,
)

STRING, BIG, WRITE_ONLY, REAL, EMPTY = range(0x2000, 0x2005)
FILE = 0x2100
OWN = [
    ObjectEntry(STRING, 0, 'text', DataType.VISIBLE_STRING, default='abc'),
    ObjectEntry(BIG, 0, 'big', DataType.UNSIGNED64, default=1),
    ObjectEntry(WRITE_ONLY, 0, 'wo', DataType.UNSIGNED8, AccessType.WRITE_ONLY),
    ObjectEntry(REAL, 0, 'real', DataType.REAL32, default=1.5),
    ObjectEntry(EMPTY, 0, 'domain', DataType.DOMAIN),
    ObjectEntry(FILE, 0, 'File', DataType.DOMAIN),
    *(
        ObjectEntry(index, sub, 'Channel', DataType.UNSIGNED32, default=COB_ID_INVALID)
        for index in (0x1201, 0x1202)
        for sub in (1, 2)
    ),
]
"""Objects of kinds that a drive does not have, and two SDO channels, which do not exist yet."""


def dictionary() -> ObjectDictionary:
    """Return the drive's objects, one of them with limits, and ours."""
    drive = (
        replace(entry, low_limit=-5, high_limit=9) if entry.index == 0x607C else entry
        for entry in drive_dictionary()
    )
    return ObjectDictionary([*drive, *OWN])


@pytest.fixture
def rig() -> Rig:
    """A device in Pre-operational."""
    rig = Rig(dictionary())
    rig.take()
    return rig


TRANSCRIPTS = {
    'expedited write without size takes the size of the object': (
        '22 6060 00 08000000 > 60 6060 00 00000000',
        '40 6060 00 00000000 > 4F 6060 00 08000000',
    ),
    'segmented write of 4 bytes': (
        '21 7A60 00 04000000 > 60 7A60 00 00000000',
        '07 FFFFFFFF 000000 > 20 00000000000000',
        '40 7A60 00 00000000 > 43 7A60 00 FFFFFFFF',
    ),
    'segmented write without size': (
        '20 7A60 00 00000000 > 60 7A60 00 00000000',
        '07 01000000 000000 > 20 00000000000000',
    ),
    'read of nothing': (
        '40 0420 00 00000000 > 41 0420 00 00000000',
        '60 00000000000000 > 0F 00000000000000',
    ),
    'no such object': (
        '40 0050 00 00000000 > 80 0050 00 00000206',
        '2F 0050 00 01000000 > 80 0050 00 00000206',
    ),
    'no such sub-index': (
        '40 1810 09 00000000 > 80 1810 09 11000906',
        '40 0010 01 00000000 > 80 0010 01 11000906',
    ),
    'write to a read-only object': ('23 0010 00 00000000 > 80 0010 00 02000106',),
    'write to a constant': ('2F 1810 00 04000000 > 80 1810 00 02000106',),
    'segmented write to a read-only object': ('21 0810 00 09000000 > 80 0810 00 02000106',),
    'read of a write-only object': ('40 0220 00 00000000 > 80 0220 00 01000106',),
    'too long': ('23 1710 00 E8030000 > 80 1710 00 12000706',),
    'too short': ('2F 1710 00 E8000000 > 80 1710 00 13000706',),
    'announced size too long': ('21 7A60 00 05000000 > 80 7A60 00 12000706',),
    'expedited cannot fill 8 bytes': ('22 0120 00 01020304 > 80 0120 00 13000706',),
    'more segments than announced': (
        '21 0020 00 03000000 > 60 0020 00 00000000',
        '00 30313233343536 > 80 0020 00 12000706',
        '40 0020 00 00000000 > 47 0020 00 61626300',
    ),
    'fewer segments than announced': (
        '21 0020 00 09000000 > 60 0020 00 00000000',
        '01 30313233343536 > 80 0020 00 13000706',
    ),
    'toggle bit not alternated in a download': (
        '21 0020 00 0A000000 > 60 0020 00 00000000',
        '10 30313233343536 > 80 0020 00 00000305',
        '00 30313233343536 > 80 0000 00 01000405',
    ),
    'toggle bit not alternated in an upload': (
        '40 0810 00 00000000 > 41 0810 00 17000000',
        '70 00000000000000 > 80 0810 00 00000305',
    ),
    'segments without a transfer': (
        '60 00000000000000 > 80 0000 00 01000405',
        '00 00000000000000 > 80 0000 00 01000405',
    ),
    'segment of the wrong direction': (
        '40 0810 00 00000000 > 41 0810 00 17000000',
        '00 00000000000000 > 80 0810 00 01000405',
    ),
    'a new request gives up the transfer under way': (
        '40 0810 00 00000000 > 41 0810 00 17000000',
        '40 0010 00 00000000 > 43 0010 00 92010200',
        '60 00000000000000 > 80 0000 00 01000405',
    ),
    'abort by the client is not answered': (
        '40 0810 00 00000000 > 41 0810 00 17000000',
        '80 0810 00 00000008 >',
        '60 00000000000000 > 80 0000 00 01000405',
    ),
    'unknown command specifier': ('E0 3412 56 00000000 > 80 3412 56 01000405',),
    'no data: an error that did not occur': ('40 0310 01 00000000 > 80 0310 01 24000008',),
    'more text than 64 KiB': ('21 0020 00 01000100 > 80 0020 00 05000405',),
    'a frame that is too short is no SDO': ('40 0010 00 >',),
}
"""Requests and answers in hex: command, index, sub-index, data."""


@pytest.mark.parametrize('name', TRANSCRIPTS)
def test_transcript(rig: Rig, name: str) -> None:
    """The device answers byte by byte what CiA 301, 7.2.4.3 says."""
    for exchange in TRANSCRIPTS[name]:
        request, answer = map(bytes.fromhex, exchange.split('>'))
        assert rig.raw_sdo(request) == (answer or None), exchange


def test_silent_client_is_given_up(rig: Rig) -> None:
    """A transfer without a request for a second is aborted with a time-out, once."""
    rig.raw_sdo(bytes.fromhex('40 08 10 00 00 00 00 00'))
    rig.run(0.9)
    rig.raw_sdo(bytes.fromhex('60 00 00 00 00 00 00 00'))
    rig.run(0.9)
    assert rig.take() == []
    rig.run(5.0)
    assert rig.take(0x580 + NODE_ID) == [bytes.fromhex('80 08 10 00 00 00 04 05')]
    rig.read(0x1008)
    rig.write(STRING, 0, b'0123456789')
    rig.take()
    rig.run(5.0)  # after transfers that came to their end nothing is aborted
    assert rig.take() == []


VALUES = [
    (0x6060, 0, 5, AbortCode.VALUE_RANGE),  # reserved
    (0x6060, 0, -1, AbortCode.VALUE_RANGE),
    (0x605A, 0, 9, AbortCode.VALUE_RANGE),
    (0x605B, 0, 2, AbortCode.VALUE_RANGE),
    (0x605D, 0, 0, AbortCode.VALUE_RANGE),
    (0x605E, 0, 5, AbortCode.VALUE_RANGE),
    (0x6083, 0, 0, AbortCode.VALUE_LOW),
    (0x607C, 0, 10, AbortCode.VALUE_HIGH),
    (0x607C, 0, -6, AbortCode.VALUE_LOW),
    (0x607C, 0, 9, 0),
    (0x607C, 0, -5, 0),
    (0x1019, 0, 241, AbortCode.VALUE_HIGH),
    (0x1029, 1, 3, AbortCode.VALUE_HIGH),
    (0x1003, 0, 1, AbortCode.VALUE_RANGE),
    (0x1005, 0, 0x40000080, AbortCode.VALUE_RANGE),  # it is no SYNC producer
    (0x1014, 0, 0x86, AbortCode.VALUE_RANGE),  # changed while in use
]


@pytest.mark.parametrize(('index', 'subindex', 'value', 'code'), VALUES)
def test_value_without_meaning_is_refused(
    rig: Rig, index: int, subindex: int, value: int, code: int
) -> None:
    """What the device cannot do it does not accept, and keeps what it had."""
    before = rig.get(index, subindex)
    assert rig.refused(index, value, subindex) == code
    assert rig.get(index, subindex) == (before if code else value)


@pytest.mark.slow
@given(text=st.text(st.characters(max_codepoint=0xFF), max_size=200))
def test_strings_come_back(text: str) -> None:
    """Whatever text is written is read again, however many segments it takes."""
    rig = Rig(dictionary())
    rig.write(STRING, 0, text.encode('latin-1'))
    assert rig.read(STRING) == text.encode('latin-1')


FILE_NAME = struct.pack('<HB', FILE, 0)
RESPONSE = 0x580 + NODE_ID


def query(rig: Rig, data: bytes) -> list[bytes]:
    """Send a frame on the default channel and return all answers."""
    rig.take()
    rig.send(0x600 + NODE_ID, data)
    return rig.take(RESPONSE)


def segments(data: bytes) -> list[bytes]:
    """Cut data into segments, all of one block."""
    parts = [data[start : start + 7] for start in range(0, max(1, len(data)), 7)]
    return [
        bytes((number | (0x80 if number == len(parts) else 0),)) + part.ljust(7, b'\0')
        for number, part in enumerate(parts, start=1)
    ]


def begin_download(rig: Rig, size: int) -> None:
    """Initiate a block download of the file, with its length and a checksum."""
    begin = struct.pack('<B3sI', 0xC6, FILE_NAME, size)
    assert query(rig, begin) == [struct.pack('<B3sB3x', 0xA4, FILE_NAME, 127)]


def end_of(data: bytes, crc: int | None = None) -> bytes:
    """Return the end of a block download."""
    unused = -len(data) % 7 if data else 7
    value = crc_hqx(data, 0) if crc is None else crc
    return struct.pack('<BH5x', 0xC1 | unused << 2, value)


def download(rig: Rig, data: bytes) -> None:
    """Write the file in one block."""
    begin_download(rig, len(data))
    block = segments(data)
    answers = [answer for frame in block for answer in query(rig, frame)]
    assert answers == [bytes((0xA2, len(block), 127, 0, 0, 0, 0, 0))]
    assert query(rig, end_of(data)) == [b'\xa1' + bytes(7)]


def test_lost_segment_of_a_download_is_sent_again(rig: Rig) -> None:
    """The device says how far segments came in order, and takes the rest in the next block."""
    data = bytes(range(70))
    begin_download(rig, len(data))
    frames, again = segments(data), segments(data[21:])
    for sent, taken in ((frames[:3] + frames[4:], 3), (again, 7)):
        answers = [answer for frame in sent for answer in query(rig, frame)]
        assert answers == [bytes((0xA2, taken, 127, 0, 0, 0, 0, 0))]
    assert query(rig, end_of(data)) == [b'\xa1' + bytes(7)]
    assert rig.read(FILE) == data


def abort_code(answers: list[bytes]) -> int:
    """Return the code of the one answer, which is an abort of the file's transfer."""
    (answer,) = answers
    assert answer[:4] == b'\x80' + FILE_NAME
    return int(struct.unpack_from('<I', answer, 4)[0])


def test_wrong_checksum_and_lengths(rig: Rig) -> None:
    """Damaged data, less or more than was announced are refused; the object keeps its value."""
    download(rig, b'before')
    begin_download(rig, 6)
    query(rig, segments(b'after!')[0])
    assert abort_code(query(rig, end_of(b'after!', crc=0x1234))) == AbortCode.CRC
    begin_download(rig, 20)
    query(rig, segments(b'short')[0])
    assert abort_code(query(rig, end_of(b'short'))) == AbortCode.LENGTH_LOW
    begin_download(rig, 3)
    query(rig, b'\x01' + bytes(7))
    assert abort_code(query(rig, b'\x82' + bytes(7))) == AbortCode.LENGTH_HIGH
    assert rig.read(FILE) == b'before'


def test_nonsense_in_a_transfer(rig: Rig) -> None:
    """Sequence number 0, blocks without length and commands out of turn are aborted."""
    begin_download(rig, 20)
    assert abort_code(query(rig, bytes(8))) == AbortCode.SEQUENCE_NUMBER
    begin = struct.pack('<B3sBB2x', 0xA4, FILE_NAME, 0, 0)
    assert abort_code(query(rig, begin)) == AbortCode.BLOCK_SIZE
    download(rig, b'0123456789')
    query(rig, struct.pack('<B3sBB2x', 0xA4, FILE_NAME, 10, 0))
    query(rig, b'\xa3' + bytes(7))
    assert abort_code(query(rig, b'\xa2\x7f\x0a' + bytes(5))) == AbortCode.SEQUENCE_NUMBER
    query(rig, struct.pack('<B3sBB2x', 0xA4, FILE_NAME, 10, 0))
    assert abort_code(query(rig, b'\xa1' + bytes(7))) == AbortCode.COMMAND_SPECIFIER
    for orphan in (b'\xa3', b'\xa2', b'\xa1', b'\xc1'):
        (answer,) = query(rig, orphan + bytes(7))
        assert struct.unpack_from('<I', answer, 4)[0] == AbortCode.COMMAND_SPECIFIER


def test_the_end_of_a_stream(rig: Rig) -> None:
    """An abort between segments, which have no command byte, or a time-out in a silence."""
    begin_download(rig, 20)
    query(rig, b'\x01' + bytes(7))
    assert query(rig, b'\x80' + FILE_NAME + bytes(4)) == []
    rig.run(5.0)
    assert rig.take() == []
    assert rig.read(FILE) == b''
    begin_download(rig, 20)
    rig.run(5.0)
    assert abort_code(rig.take(RESPONSE)) == AbortCode.TIMED_OUT


def test_little_data_by_the_other_protocol(rig: Rig) -> None:
    """Below the client's threshold the device answers as to a normal upload."""
    begin = struct.pack('<BHBBB2x', 0xA4, 0x1000, 0, 127, 4)
    (answer,) = query(rig, begin)
    assert sdo.decode_response(answer) == sdo.UploadResponse(0x1000, 0, b'\x92\x01\x02\x00', 4)


def test_more_channels_are_independent(rig: Rig) -> None:
    """A transfer on each channel at the same time; a channel exists as 0x1201 says."""
    read = sdo.UploadRequest(0x1008, 0).encode()
    rig.send(0x6C0, read)
    assert rig.take() == []
    for index, request, response in ((0x1201, 0x6C0, 0x6D0), (0x1202, 0x6C1, 0x6D1)):
        rig.put(index, request, 1)
        rig.put(index, response, 2)
    rig.take()
    for can_id in (0x600 + NODE_ID, 0x6C0, 0x6C1):
        rig.send(can_id, read)
    assert [frame.can_id for _, frame in rig.sent] == [RESPONSE, 0x6D0, 0x6D1]
    rig.take()
    for can_id in (0x6C0, 0x6C1, 0x600 + NODE_ID):
        rig.device.receive(Frame(can_id, b'\x60' + bytes(7)), rig.now)
    assert rig.take(0x6D0)[0] == b'\x00' + b'Simulat'
    rig.put(0x1201, COB_ID_INVALID | 0x6C0, 1)
    rig.take()
    rig.send(0x6C0, read)
    assert rig.take() == []
