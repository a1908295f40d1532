# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""SDO frames and abort codes (CiA 301, 7.2.4.3), for client and server alike.

Each message is a value with ``encode()``; ``decode_request`` reads frames of a client,
``decode_response`` those of a server. Both refuse the block protocol (7.2.4.3.9), which has
functions of its own.
Some servers leave out the unused bytes of a frame, or answer with four bytes for a smaller object;
``decode_response`` and ``fitted`` accept both.
"""

from __future__ import annotations

from binascii import crc_hqx
from dataclasses import dataclass
from enum import IntEnum
import struct
from typing import ClassVar, TYPE_CHECKING, TypeAlias

from ..exceptions import CodecError
from .datatypes import byte_length, DataType

if TYPE_CHECKING:
    from typing_extensions import Self


FRAME_BYTES = 8
EXPEDITED_MAX = 4  # [byte]
SEGMENT_MAX = 7  # [byte]


@dataclass(frozen=True, slots=True)
class _Initiate:
    """Start of a transfer: expedited if ``data`` is given, else segmented."""

    index: int
    subindex: int
    data: bytes | None  # the whole value of an expedited transfer, else None
    # length of the value in [byte] if the frame has it; without it the receiver takes from
    # expedited data as many bytes as its object has
    size: int | None = None
    specifier: ClassVar[int]

    def encode(self) -> bytes:
        """Return the 8 bytes of the frame.

        Raises:
            CodecError: Expedited data are not 1 to 4 bytes long.
        """
        command, indicated = self.specifier, self.size is not None
        if self.data is None:
            command |= indicated
            return struct.pack('<BHBI', command, self.index, self.subindex, self.size or 0)
        unused = EXPEDITED_MAX - len(self.data)
        if not 0 <= unused < EXPEDITED_MAX:
            raise CodecError(f'an expedited transfer carries 1 to 4 bytes, got {len(self.data)}')
        command |= 0x02 | (unused << 2 | 0x01 if indicated else 0)
        return struct.pack('<BHB', command, self.index, self.subindex) + self.data + bytes(unused)


class DownloadRequest(_Initiate):
    """Initiate a write."""

    __slots__ = ()
    specifier = 0x20


class UploadResponse(_Initiate):
    """Answer to a read."""

    __slots__ = ()
    specifier = 0x40


@dataclass(frozen=True, slots=True)
class _Address:
    index: int
    subindex: int
    specifier: ClassVar[int]

    def encode(self) -> bytes:
        """Return the 8 bytes of the frame."""
        return struct.pack('<BHB4x', self.specifier, self.index, self.subindex)


class DownloadResponse(_Address):
    """Acknowledges the start of a write or, if expedited, the whole write."""

    __slots__ = ()
    specifier = 0x60


class UploadRequest(_Address):
    """Initiate a read."""

    __slots__ = ()
    specifier = 0x40


@dataclass(frozen=True, slots=True)
class Segment:
    """Up to seven bytes of a segmented transfer, in either direction."""

    toggle: bool
    data: bytes
    last: bool

    def encode(self) -> bytes:
        """Return the 8 bytes of the frame.

        Raises:
            CodecError: The data are longer than 7 bytes.
        """
        unused = SEGMENT_MAX - len(self.data)
        if unused < 0:
            raise CodecError(f'an SDO segment carries 7 bytes at most, got {len(self.data)}')
        command = self.toggle << 4 | unused << 1 | self.last
        return bytes((command,)) + self.data + bytes(unused)


@dataclass(frozen=True, slots=True)
class _Toggle:
    toggle: bool
    specifier: ClassVar[int]

    def encode(self) -> bytes:
        """Return the 8 bytes of the frame."""
        return bytes((self.specifier | self.toggle << 4,)) + bytes(7)


class UploadSegmentRequest(_Toggle):
    """Request the next segment of a read."""

    __slots__ = ()
    specifier = 0x60


class DownloadSegmentResponse(_Toggle):
    """Acknowledges a segment of a write."""

    __slots__ = ()
    specifier = 0x20


@dataclass(frozen=True, slots=True)
class Abort:
    """Aborts the transfer; sent by either side."""

    index: int
    subindex: int
    code: int

    def encode(self) -> bytes:
        """Return the 8 bytes of the frame."""
        return struct.pack('<BHBI', 0x80, self.index, self.subindex, self.code)


Request: TypeAlias = DownloadRequest | UploadRequest | Segment | UploadSegmentRequest | Abort
Response: TypeAlias = DownloadResponse | UploadResponse | Segment | DownloadSegmentResponse | Abort


def _decode_initiate(data: bytes) -> tuple[int, int, bytes | None, int | None]:
    command, index, subindex = struct.unpack_from('<BHB', data)
    indicated = bool(command & 0x01)
    if not command & 0x02:
        size = int.from_bytes(data[4:], 'little')
        return index, subindex, None, size if indicated else None
    if not indicated:
        return index, subindex, data[4:], None
    length = EXPEDITED_MAX - (command >> 2 & 0x03)
    return index, subindex, data[4 : 4 + length], length


def _decode_segment(data: bytes) -> Segment:
    command = data[0]
    length = SEGMENT_MAX - (command >> 1 & 0x07)
    return Segment(bool(command & 0x10), data[1 : 1 + length], bool(command & 0x01))


def _padded(data: bytes) -> bytes:
    """Return a frame of a server, padded with unused bytes that it may have left out."""
    if not data or len(data) > FRAME_BYTES or len(data) < _used_bytes(data[0]):
        raise CodecError(f'an SDO frame has 8 bytes, got {len(data)}')
    if data[0] >> 5 == 2 and data[0] & 0x03 == 0x02:  # the frame's length is that of the value
        return data
    return data.ljust(FRAME_BYTES, b'\0')


def _used_bytes(command: int) -> int:
    """Return the number of used bytes of a response, from its command byte."""
    match command >> 5:
        case 0:  # a segment of an upload
            return 1 + SEGMENT_MAX - (command >> 1 & 0x07)
        case 1:
            return 1
        case 2 if command & 0x03 == 0x03:
            return FRAME_BYTES - (command >> 2 & 0x03)
        case 2:
            return {0x00: 4, 0x01: 8, 0x02: 5}[command & 0x03]
        case 3 | 4:  # an abort without its code is an abort nevertheless
            return 4
    return FRAME_BYTES


def fitted(data_type: DataType, data: bytes) -> bytes:
    """Return the value of an expedited upload, cut to the length of its type.

    Servers that omit the size, or always state four bytes, send four for a smaller object.
    """
    size = byte_length(data_type)
    return data[:size] if size is not None and size < len(data) <= EXPEDITED_MAX else data


def decode_request(data: bytes) -> Request:
    """Read a frame from a client.

    Raises:
        CodecError: The frame is not 8 bytes long, or its command specifier is unknown.
    """
    if len(data) != FRAME_BYTES:
        raise CodecError(f'an SDO frame has 8 bytes, got {len(data)}')
    match data[0] >> 5:
        case 0:
            return _decode_segment(data)
        case 1:
            return DownloadRequest(*_decode_initiate(data))
        case 2:
            return UploadRequest(*struct.unpack('<xHB4x', data))
        case 3:
            return UploadSegmentRequest(bool(data[0] & 0x10))
        case 4:
            return Abort(*struct.unpack('<xHBI', data))
    raise CodecError(f'SDO client command specifier {data[0] >> 5} is not supported')


def decode_response(data: bytes) -> Response:
    """Read a frame from a server.

    Raises:
        CodecError: Bytes are missing, or the command specifier is unknown.
    """
    data = _padded(data)
    match data[0] >> 5:
        case 0:
            return _decode_segment(data)
        case 1:
            return DownloadSegmentResponse(bool(data[0] & 0x10))
        case 2:
            return UploadResponse(*_decode_initiate(data))
        case 3:
            return DownloadResponse(*struct.unpack('<xHB4x', data))
        case 4:
            return Abort(*struct.unpack('<xHBI', data))
    raise CodecError(f'SDO server command specifier {data[0] >> 5} is not supported')


SEGMENT_BYTES = 7  # [byte] payload of a segment
BLOCK_SEGMENTS_MAX = 127  # a sequence number has 7 bits
LAST = 0x80  # bit of a segment: no further ones follow
CRC_BIT = 0x04  # of both initiations: checksums are supported
SIZE_BIT = 0x02  # of both initiations: the length is given

CLIENT_UPLOAD, CLIENT_DOWNLOAD = 5, 6  # client command specifiers
DOWNLOAD_INITIATE, DOWNLOAD_END = 0xC0, 0xC1
DOWNLOAD_INITIATED, DOWNLOAD_ACKNOWLEDGED, DOWNLOAD_ENDED = 0xA0, 0xA2, 0xA1
UPLOAD_INITIATE = 0xA0
UPLOAD_INITIATED, UPLOAD_END = 0xC0, 0xC1
END_UPLOAD, ACKNOWLEDGE_UPLOAD, START_UPLOAD = 1, 2, 3  # client subcommands of an upload


def checksum(data: bytes) -> int:
    """Return the CRC of a block transfer: polynomial x^16 + x^12 + x^5 + 1, initially 0."""
    return crc_hqx(data, 0)


def unused_bytes(size: int) -> int:
    """Return the number of unused bytes in the last segment of a value of this size in [byte]."""
    return -size % SEGMENT_BYTES if size else SEGMENT_BYTES


def end_frame(command: int, data: bytes, *, with_crc: bool) -> bytes:
    """Return `DOWNLOAD_END` or `UPLOAD_END` for all data, with a checksum if agreed."""
    crc = checksum(data) if with_crc else 0
    return struct.pack('<BH5x', command | unused_bytes(len(data)) << 2, crc)


def block_frames(data: bytes, position: int, segments: int) -> list[bytes]:
    """Return the segments of the next block; the other side has the data before ``position``."""
    frames = []
    for number in range(1, segments + 1):
        start = position + (number - 1) * SEGMENT_BYTES
        part = data[start : start + SEGMENT_BYTES]
        last = start + SEGMENT_BYTES >= len(data)
        frames.append(bytes((number | (LAST if last else 0),)) + part.ljust(SEGMENT_BYTES, b'\0'))
        if last:
            break
    return frames


class CodeWithText(IntEnum):
    """Enum of codes, each with its meaning as ``text``."""

    text: str

    def __new__(cls, code: int, text: str = '') -> Self:
        """Create a member from code and text; a lookup needs the code only."""
        member = int.__new__(cls, code)
        member._value_ = code
        member.text = text
        return member


class AbortCode(CodeWithText):
    """SDO abort codes, each with its meaning as ``text``."""

    TOGGLE_BIT = 0x0503_0000, 'toggle bit not alternated'
    TIMED_OUT = 0x0504_0000, 'SDO protocol timed out'
    COMMAND_SPECIFIER = 0x0504_0001, 'command specifier not valid or unknown'
    BLOCK_SIZE = 0x0504_0002, 'invalid block size'
    SEQUENCE_NUMBER = 0x0504_0003, 'invalid sequence number'
    CRC = 0x0504_0004, 'CRC error'
    OUT_OF_MEMORY = 0x0504_0005, 'out of memory'
    UNSUPPORTED_ACCESS = 0x0601_0000, 'unsupported access to an object'
    WRITE_ONLY = 0x0601_0001, 'attempt to read a write-only object'
    READ_ONLY = 0x0601_0002, 'attempt to write a read-only object'
    NO_OBJECT = 0x0602_0000, 'object does not exist in the object dictionary'
    NOT_MAPPABLE = 0x0604_0041, 'object cannot be mapped to the PDO'
    PDO_LENGTH = 0x0604_0042, 'mapped objects would exceed the PDO length'
    PARAMETER_INCOMPATIBLE = 0x0604_0043, 'general parameter incompatibility'
    INTERNAL_INCOMPATIBLE = 0x0604_0047, 'general internal incompatibility in the device'
    HARDWARE = 0x0606_0000, 'access failed due to a hardware error'
    LENGTH = 0x0607_0010, 'data type does not match, length does not match'
    LENGTH_HIGH = 0x0607_0012, 'data type does not match, length too high'
    LENGTH_LOW = 0x0607_0013, 'data type does not match, length too low'
    NO_SUBINDEX = 0x0609_0011, 'sub-index does not exist'
    VALUE_RANGE = 0x0609_0030, 'invalid value for parameter'
    VALUE_HIGH = 0x0609_0031, 'value of parameter written too high'
    VALUE_LOW = 0x0609_0032, 'value of parameter written too low'
    MAXIMUM_BELOW_MINIMUM = 0x0609_0036, 'maximum value is less than minimum value'
    RESOURCE_UNAVAILABLE = 0x060A_0023, 'resource not available: SDO connection'
    GENERAL = 0x0800_0000, 'general error'
    DATA_TRANSFER = 0x0800_0020, 'data cannot be transferred or stored to the application'
    LOCAL_CONTROL = 0x0800_0021, 'data cannot be transferred because of local control'
    DEVICE_STATE = 0x0800_0022, 'data cannot be transferred in the present device state'
    NO_DICTIONARY = 0x0800_0023, 'object dictionary not present'
    NO_DATA = 0x0800_0024, 'no data available'


def abort_text(code: int) -> str:
    """Describe an abort code."""
    try:
        return f'{AbortCode(code).text} (0x{code:08X})'
    except ValueError:
        return f'unknown abort code 0x{code:08X}'
