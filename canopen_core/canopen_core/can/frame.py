# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""CAN frames, the content of error frames, bus load, and a ring of the last frames."""

from __future__ import annotations

from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass
from enum import Enum
import struct
from typing import NamedTuple

STANDARD_ID_MAX = 0x7FF  # 11 bits
EXTENDED_ID_MAX = 0x1FFF_FFFF  # 29 bits
PAYLOAD_MAX = 8  # [byte]


class Frame(NamedTuple):
    """A classic CAN frame (ISO 11898-1). A tuple, because thousands are created each second."""

    can_id: int  # 11-bit or 29-bit identifier
    data: bytes = b''  # payload of 0 to 8 bytes
    # time of reception on the steady clock (``time.monotonic``) in [s]; 0 when not received
    timestamp: float = 0.0
    is_extended: bool = False  # the identifier has 29 bits
    is_remote: bool = False  # remote transmission request; the payload is empty
    # error frame of the controller; can_id and data are the kernel's error classes
    is_error: bool = False
    remote_length: int = 0  # length of the data that a remote request asks for in [byte]


def checked(frame: Frame) -> Frame:
    """Return the frame if it is a valid classic CAN frame.

    Raises:
        ValueError: The identifier is out of range or the payload too long.
    """
    if not 0 <= frame.can_id <= (EXTENDED_ID_MAX if frame.is_extended else STANDARD_ID_MAX):
        raise ValueError(f'CAN identifier 0x{frame.can_id:X} is out of range')
    if len(frame.data) > PAYLOAD_MAX:
        raise ValueError(f'a CAN frame carries at most {PAYLOAD_MAX} bytes, got {len(frame.data)}')
    if not 0 <= frame.remote_length <= (PAYLOAD_MAX if frame.is_remote else 0):
        raise ValueError(f'{frame.remote_length} bytes cannot be requested by such a frame')
    return frame


# Error frames of a CAN controller: linux/can/error.h
ERROR_CLASSES: tuple[tuple[int, str], ...] = (
    (0x001, 'transmit timeout'),
    (0x002, 'arbitration lost'),
    (0x004, 'controller problem'),
    (0x008, 'protocol violation'),
    (0x010, 'transceiver problem'),
    (0x020, 'no acknowledge'),
    (0x040, 'bus off'),
    (0x080, 'bus error'),
    (0x100, 'controller restarted'),
)
"""Bit of the identifier and its meaning."""

CONTROLLER_PROBLEMS: tuple[tuple[int, str], ...] = (
    (0x01, 'receive buffer overflow'),
    (0x02, 'transmit buffer overflow'),
    (0x04, 'receive errors at warning level'),
    (0x08, 'transmit errors at warning level'),
    (0x10, 'receive error passive'),
    (0x20, 'transmit error passive'),
    (0x40, 'error active again'),
)
"""Bit of data[1] and its meaning, for a controller problem."""

PROTOCOL_VIOLATIONS: tuple[tuple[int, str], ...] = (
    (0x01, 'single bit'),
    (0x02, 'frame format'),
    (0x04, 'bit stuffing'),
    (0x08, 'dominant bit not sent'),
    (0x10, 'recessive bit not sent'),
    (0x20, 'bus overload'),
    (0x40, 'active error announcement'),
    (0x80, 'on transmission'),
)
"""Bit of data[2] and its meaning, for a protocol violation."""

_CONTROLLER = 0x004
_PROTOCOL = 0x008
_NO_ACKNOWLEDGE = 0x020
_BUS_OFF = 0x040
_RESTARTED = 0x100
_COUNTERS = 0x200  # data[6] and data[7] are the transmit and receive error counters
_WARNING_LEVEL, _PASSIVE, _ACTIVE_AGAIN = 0x0C, 0x30, 0x40  # of CONTROLLER_PROBLEMS


class ControllerState(Enum):
    """Error state of a CAN controller (ISO 11898-1, fault confinement); the value is its name."""

    ACTIVE = 'error active'
    WARNING = 'error warning'
    PASSIVE = 'error passive'
    BUS_OFF = 'bus off'


def controller_state(frame: Frame) -> ControllerState | None:
    """Return the controller state in an error frame; None if it reports none."""
    if frame.can_id & _BUS_OFF:
        return ControllerState.BUS_OFF
    if frame.can_id & _RESTARTED:
        return ControllerState.ACTIVE
    problem = frame.data[1] if frame.can_id & _CONTROLLER and len(frame.data) > 1 else 0
    if problem & _PASSIVE:
        return ControllerState.PASSIVE
    if problem & _WARNING_LEVEL:
        return ControllerState.WARNING
    return ControllerState.ACTIVE if problem & _ACTIVE_AGAIN else None


def error_counters(frame: Frame) -> tuple[int, int] | None:
    """Return transmit and receive error counter of an error frame; None if it has none."""
    if not frame.can_id & _COUNTERS or len(frame.data) < 8:
        return None
    return frame.data[6], frame.data[7]


def is_unacknowledged(frame: Frame) -> bool:
    """Whether an error frame reports that no other node acknowledged a frame."""
    return bool(frame.can_id & _NO_ACKNOWLEDGE)


def error_text(frame: Frame) -> str:
    """Describe an error frame, e.g. ``controller problem (transmit error passive)``."""
    data = frame.data.ljust(8, b'\0')
    tables = {
        _CONTROLLER: (CONTROLLER_PROBLEMS, data[1]),
        _PROTOCOL: (PROTOCOL_VIOLATIONS, data[2]),
    }
    parts = []
    for bit, text in ERROR_CLASSES:
        if frame.can_id & bit:
            table, bits = tables.get(bit, ((), 0))
            details = ', '.join(detail for each, detail in table if bits & each)
            parts.append(f'{text} ({details})' if details else text)
    if frame.can_id & _COUNTERS:
        parts.append(f'{data[6]} transmit and {data[7]} receive errors counted')
    return ', '.join(parts) or f'error class 0x{frame.can_id:X}'


# A data frame with an 11-bit identifier and n bytes takes 44 + 8n bits and 3 bits of intermission;
# one with a 29-bit identifier takes 20 more (ISO 11898-1, 10.4). The bits from the start of frame
# to the CRC, 34 + 8n (54 + 8n), are stuffed: at most one bit is added after the first five and
# then after every four (R. I. Davis et al., "Controller Area Network (CAN) schedulability
# analysis: Refuted, revisited and revised", 2007, equation 1). In random bits one is added after
# every 30.
_FRAME_BITS = 47  # [bit] without payload, with intermission
_STUFFED_BITS = 34  # [bit] without payload
_EXTENSION_BITS = 20  # [bit] of a 29-bit identifier
_WORST_STUFF_DISTANCE = 4  # [bit]
_MEAN_STUFF_DISTANCE = 30  # [bit] 2^5 - 2
_SAMPLES = 10  # per window


def frame_bits(size: int, *, is_extended: bool = False) -> int:
    """Return the bits of a frame with size [byte] of payload: intermission, but no stuff bits."""
    return _FRAME_BITS + 8 * size + (_EXTENSION_BITS if is_extended else 0)


def stuff_bits_worst(size: int, *, is_extended: bool = False) -> int:
    """Return the greatest number of stuff bits of a frame."""
    return (_stuffed_bits(size, is_extended) - 1) // _WORST_STUFF_DISTANCE


def stuff_bits_mean(size: int, *, is_extended: bool = False) -> float:
    """Return the mean number of stuff bits of a frame with random content."""
    return (_stuffed_bits(size, is_extended) - 1) / _MEAN_STUFF_DISTANCE


def _stuffed_bits(size: int, is_extended: bool) -> int:
    return _STUFFED_BITS + 8 * size + (_EXTENSION_BITS if is_extended else 0)


@dataclass(frozen=True, slots=True)
class LoadFigures:
    """Load of a bus in the last window."""

    frames_per_second: float = 0.0  # frames in [1/s]
    # share of the time that the bus was busy, 0 to 1, with the stuffing of random content
    load: float = 0.0


class BusLoad:
    """Estimates the bus load from sent and received frames.

    Counting a frame is one addition; the rest is computed when the figures are read.
    """

    def __init__(self, bitrate: int, now: float, window: float = 1.0) -> None:
        """Start at a steady time in [s]; figures cover the last window [s] if they are read often.

        Raises:
            ValueError: Bit rate in [bit/s] or window is not positive.
        """
        if bitrate <= 0 or window <= 0.0:
            raise ValueError(f'bit rate {bitrate} and window {window} must be positive')
        self._bitrate = bitrate
        self._window = window
        self._standard = [0] * (PAYLOAD_MAX + 1)  # frames by length of the payload
        self._extended = [0] * (PAYLOAD_MAX + 1)
        self._samples = deque([self._sample(now)])

    def count(self, frame: Frame) -> None:
        """Count a sent or received frame; error frames use no bus time and are not counted."""
        if frame.is_error:
            return
        counts = self._extended if frame.is_extended else self._standard
        counts[len(frame.data)] += 1

    def figures(self, now: float) -> LoadFigures:
        """Return the figures of the last window before a steady time in [s]."""
        newest = self._sample(now)
        samples = self._samples
        while len(samples) > 1 and samples[1][0] <= now - self._window:
            samples.popleft()
        begin, frames_before, bits_before = samples[0]
        if now - samples[-1][0] >= self._window / _SAMPLES:
            samples.append(newest)
        span, (_, frames, bits) = now - begin, newest
        if span <= 0.0:
            return LoadFigures()
        return LoadFigures(
            (frames - frames_before) / span, (bits - bits_before) / (span * self._bitrate)
        )

    def _sample(self, now: float) -> tuple[float, int, float]:
        """Return the time, and the numbers of frames and bits up to it."""
        frames, bits = 0, 0.0
        for is_extended, counts in ((False, self._standard), (True, self._extended)):
            for size, count in enumerate(counts):
                plain = frame_bits(size, is_extended=is_extended)
                frames += count
                bits += count * (plain + stuff_bits_mean(size, is_extended=is_extended))
        return now, frames, bits


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
    """Ring buffer of the last frames; new frames overwrite the oldest.

    Frames are packed into one block of bytes and leave no Python objects behind, so the garbage
    collector has nothing to scan. One thread records; any other thread may read at the same time,
    without locks.
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
        """Store a frame with its steady time in [s]; direction is :attr:`SENT` or 0 (received)."""
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
        """Yield the recorded frames in chunks, the oldest first.

        Frames that are overwritten while this is read are left out.
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
