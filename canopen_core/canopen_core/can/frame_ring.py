# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The last frames of a bus in a fixed piece of memory."""

from __future__ import annotations

from collections.abc import Iterator
import struct
from typing import NamedTuple

from .frame import Frame

_RECORD = struct.Struct('<dIB8s')  # time, identifier with flags, length with direction, data
RECORD_SIZE = _RECORD.size  # [byte]
_EXTENDED, _REMOTE, _ERROR = 0x8000_0000, 0x4000_0000, 0x2000_0000
_IDENTIFIER = 0x1FFF_FFFF
_LENGTH = 0x0F
_CHUNK = 32  # records that are copied at once


class RecordedFrame(NamedTuple):
    """A frame of the ring."""

    frame: Frame  # the frame, with its steady time in [s] also when it was sent
    sent: bool  # this process sent it; otherwise it was received


class FrameRing:
    """Keeps the last frames; the oldest make room for new ones.

    Frames are packed into one block of bytes: no object of a frame outlives it, so that the
    garbage collector has nothing to look at, however many there are. One thread records, any other
    one may read meanwhile; nothing is locked.
    """

    SENT = 0x80  # direction of a frame that this process has sent

    def __init__(self, capacity: int) -> None:
        """Allocate a record for each frame.

        Raises:
            ValueError: The capacity is not positive.
        """
        if capacity < 1:
            raise ValueError(f'a ring of {capacity} frames holds nothing')
        self.capacity = capacity  # how many frames it holds
        self.count = 0  # how many were recorded since the start
        self._places = capacity + 1  # one is being written while others are read
        self._end = self._places * RECORD_SIZE
        self._memory = bytearray(self._end)
        self._at = 0  # [byte] where the next one goes

    def record(self, frame: Frame, timestamp: float, direction: int = 0) -> None:
        """Keep a frame with its steady time in [s]; direction is :attr:`SENT` or 0 (received)."""
        can_id, data, _, is_extended, is_remote, is_error, remote_length = frame
        if is_extended or is_remote or is_error:
            can_id |= _EXTENDED * is_extended | _REMOTE * is_remote | _ERROR * is_error
        at = self._at
        length = (remote_length or len(data)) | direction
        _RECORD.pack_into(self._memory, at, timestamp, can_id, length, data)
        at += RECORD_SIZE
        self._at = at if at < self._end else 0
        self.count += 1

    def chunks(self) -> Iterator[list[RecordedFrame]]:
        """Yield what is there now, the oldest first, a few at once.

        Frames whose place is taken by newer ones while this is read are left out.
        """
        end = self.count
        number = max(0, end - self.capacity)
        while number < end:
            place = number % self._places
            size = min(_CHUNK, end - number, self._places - place)
            start = place * RECORD_SIZE
            copied = bytes(self._memory[start : start + size * RECORD_SIZE])
            overtaken = max(0, self.count - self.capacity - number)
            yield [_unpack(*record) for record in _RECORD.iter_unpack(copied)][overtaken:]
            number += size


def _unpack(timestamp: float, can_id: int, length: int, data: bytes) -> RecordedFrame:
    is_remote, size = bool(can_id & _REMOTE), length & _LENGTH
    frame = Frame(
        can_id & _IDENTIFIER,
        b'' if is_remote else data[:size],
        timestamp,
        bool(can_id & _EXTENDED),
        is_remote,
        bool(can_id & _ERROR),
        size if is_remote else 0,
    )
    return RecordedFrame(frame, bool(length & FrameRing.SENT))
