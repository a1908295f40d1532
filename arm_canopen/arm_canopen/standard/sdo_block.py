# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames of SDO block transfers (CiA 301, 7.2.4.3.8 to 17), for client and server alike."""

from __future__ import annotations

from binascii import crc_hqx
import struct

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
    """Return how many bytes of the last segment carry no data, of a value of so many bytes."""
    return -size % SEGMENT_BYTES if size else SEGMENT_BYTES


def end_frame(command: int, data: bytes, *, with_crc: bool) -> bytes:
    """Return `DOWNLOAD_END` or `UPLOAD_END` for all data, with their checksum where agreed."""
    crc = checksum(data) if with_crc else 0
    return struct.pack('<BH5x', command | unused_bytes(len(data)) << 2, crc)


def block_frames(data: bytes, position: int, segments: int) -> list[bytes]:
    """Return the segments of the next block; the other side has the data up to position."""
    frames = []
    for number in range(1, segments + 1):
        start = position + (number - 1) * SEGMENT_BYTES
        part = data[start : start + SEGMENT_BYTES]
        last = start + SEGMENT_BYTES >= len(data)
        frames.append(bytes((number | (LAST if last else 0),)) + part.ljust(SEGMENT_BYTES, b'\0'))
        if last:
            break
    return frames
