# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SDO block transfers with a simulated device, and its further SDO channels."""

from __future__ import annotations

from binascii import crc_hqx
import struct

from device_rig import drive_dictionary, NODE_ID, Rig

from canopen_core.can import Frame
from canopen_core.standard import (
    AbortCode,
    COB_ID_INVALID,
    DataType,
    ObjectDictionary,
    ObjectEntry,
    sdo,
)

FILE = 0x2100
FILE_NAME = struct.pack('<HB', FILE, 0)
RESPONSE = 0x580 + NODE_ID
ENTRIES = [
    ObjectEntry(FILE, 0, 'File', DataType.DOMAIN),
    *(
        ObjectEntry(index, sub, 'Channel', DataType.UNSIGNED32, default=COB_ID_INVALID)
        for index in (0x1201, 0x1202)
        for sub in (1, 2)
    ),
]


def make_rig() -> Rig:
    """Return a drive with a file and two more SDO channels, which do not exist yet."""
    rig = Rig(ObjectDictionary([*drive_dictionary(), *ENTRIES]))
    rig.take()
    return rig


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


def test_lost_segment_of_a_download_is_sent_again() -> None:
    """The device says how far segments came in order, and takes the rest in the next block."""
    rig = make_rig()
    data = bytes(range(70))
    begin_download(rig, len(data))
    frames = segments(data)
    answers = [answer for frame in frames[:3] + frames[4:] for answer in query(rig, frame)]
    assert answers == [bytes((0xA2, 3, 127, 0, 0, 0, 0, 0))]
    again = segments(data[21:])
    answers = [answer for frame in again for answer in query(rig, frame)]
    assert answers == [bytes((0xA2, 7, 127, 0, 0, 0, 0, 0))]
    assert query(rig, end_of(data)) == [b'\xa1' + bytes(7)]
    assert rig.read(FILE) == data


def abort_code(answers: list[bytes]) -> int:
    """Return the code of the one answer, which is an abort of the file's transfer."""
    (answer,) = answers
    assert answer[:4] == b'\x80' + FILE_NAME
    return int(struct.unpack_from('<I', answer, 4)[0])


def test_wrong_checksum_and_lengths() -> None:
    """Damaged data, less or more than was announced are refused; the object keeps its value."""
    rig = make_rig()
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


def test_nonsense_in_a_transfer() -> None:
    """Sequence number 0, blocks without length and commands out of turn are aborted."""
    rig = make_rig()
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


def test_the_end_of_a_stream() -> None:
    """An abort between segments, which have no command byte, or a time-out in a silence."""
    rig = make_rig()
    begin_download(rig, 20)
    query(rig, b'\x01' + bytes(7))
    assert query(rig, b'\x80' + FILE_NAME + bytes(4)) == []
    rig.run(5.0)
    assert rig.take() == []
    assert rig.read(FILE) == b''
    begin_download(rig, 20)
    rig.run(5.0)
    assert abort_code(rig.take(RESPONSE)) == AbortCode.TIMED_OUT


def test_little_data_by_the_other_protocol() -> None:
    """Below the client's threshold the device answers as to a normal upload."""
    rig = make_rig()
    begin = struct.pack('<BHBBB2x', 0xA4, 0x1000, 0, 127, 4)
    (answer,) = query(rig, begin)
    assert sdo.decode_response(answer) == sdo.UploadResponse(0x1000, 0, b'\x92\x01\x02\x00', 4)


def test_more_channels_are_independent() -> None:
    """A transfer on each channel at the same time; a channel exists as 0x1201 says."""
    rig = make_rig()
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
