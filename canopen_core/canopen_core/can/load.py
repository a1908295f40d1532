# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames per second and load of a CAN bus.

A data frame with an 11-bit identifier and n bytes takes 44 + 8n bits and 3 bits of intermission;
one with a 29-bit identifier takes 20 more (ISO 11898-1, 10.4). The bits from the start of frame to
the CRC, 34 + 8n (54 + 8n), are stuffed: at most one bit is added after the first five and then
after every four (R. I. Davis et al., "Controller Area Network (CAN) schedulability analysis:
Refuted, revisited and revised", 2007, equation 1). In random bits one is added after every 30.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

from .frame import Frame, PAYLOAD_MAX

_FRAME_BITS = 47  # [bit] without payload, with intermission
_STUFFED_BITS = 34  # [bit] without payload
_EXTENSION_BITS = 20  # [bit] of a 29-bit identifier
_WORST_STUFF_DISTANCE = 4  # [bit]
_MEAN_STUFF_DISTANCE = 30  # [bit] 2^5 - 2
_SAMPLES = 10  # per window


def frame_bits(size: int, *, is_extended: bool = False) -> int:
    """Return the bits of a frame with a payload of size [byte]: no stuffing, with intermission."""
    return _FRAME_BITS + 8 * size + (_EXTENSION_BITS if is_extended else 0)


def stuff_bits_worst(size: int, *, is_extended: bool = False) -> int:
    """Return how many bits stuffing adds to a frame at most."""
    return (_stuffed_bits(size, is_extended) - 1) // _WORST_STUFF_DISTANCE


def stuff_bits_mean(size: int, *, is_extended: bool = False) -> float:
    """Return how many bits stuffing adds to a frame of random content on average."""
    return (_stuffed_bits(size, is_extended) - 1) / _MEAN_STUFF_DISTANCE


def _stuffed_bits(size: int, is_extended: bool) -> int:
    return _STUFFED_BITS + 8 * size + (_EXTENSION_BITS if is_extended else 0)


@dataclass(frozen=True, slots=True)
class LoadFigures:
    """What a bus carried in the last window."""

    frames_per_second: float = 0.0  # frames in [1/s]
    # share of the time that the bus was busy, 0 to 1, with the stuffing of random content
    load: float = 0.0


@dataclass(frozen=True, slots=True)
class _Sample:
    time: float  # [s]
    frames: int
    bits: float


class BusLoad:
    """Estimates the load from the frames that are sent and received.

    Counting a frame is one addition; the arithmetic is done when the figures are read.
    """

    def __init__(self, bitrate: int, now: float, window: float = 1.0) -> None:
        """Start at a steady time in [s]; figures look back window [s] when they are read often.

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
        """Count a frame, sent or received; error frames are notes of the controller and free."""
        if frame.is_error:
            return
        counts = self._extended if frame.is_extended else self._standard
        counts[len(frame.data)] += 1

    def figures(self, now: float) -> LoadFigures:
        """Return the figures of the last window before a steady time in [s]."""
        newest = self._sample(now)
        samples = self._samples
        while len(samples) > 1 and samples[1].time <= now - self._window:
            samples.popleft()
        oldest = samples[0]
        if now - samples[-1].time >= self._window / _SAMPLES:
            samples.append(newest)
        span = now - oldest.time
        if span <= 0.0:
            return LoadFigures()
        return LoadFigures(
            (newest.frames - oldest.frames) / span,
            (newest.bits - oldest.bits) / (span * self._bitrate),
        )

    def _sample(self, now: float) -> _Sample:
        frames, bits = 0, 0.0
        for is_extended, counts in ((False, self._standard), (True, self._extended)):
            for size, count in enumerate(counts):
                plain = frame_bits(size, is_extended=is_extended)
                frames += count
                bits += count * (plain + stuff_bits_mean(size, is_extended=is_extended))
        return _Sample(now, frames, bits)
