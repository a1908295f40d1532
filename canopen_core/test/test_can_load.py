# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bus load against frames that are stuffed bit by bit."""

from __future__ import annotations

import random

from can_strategies import frames
from hypothesis import given
import pytest

from canopen_core.can import BusLoad, Frame, frame_bits, stuff_bits_mean, stuff_bits_worst


def _bits(value: int, width: int) -> list[int]:
    return [value >> place & 1 for place in reversed(range(width))]


def stuffed_region(frame: Frame) -> list[int]:
    """Return the bits from the start of frame to the CRC (ISO 11898-1, 10.4)."""
    remote = [int(frame.is_remote)]
    if frame.is_extended:
        # base identifier, SRR, IDE, identifier extension, RTR, r1, r0
        arbitration = [*_bits(frame.can_id >> 18, 11), 1, 1, *_bits(frame.can_id & 0x3FFFF, 18)]
        control = [*remote, 0, 0]
    else:
        arbitration = _bits(frame.can_id, 11)
        control = [*remote, 0, 0]  # RTR, IDE, r0
    data = [bit for byte in frame.data for bit in _bits(byte, 8)]
    bits = [0, *arbitration, *control, *_bits(len(frame.data), 4), *data]
    return bits + _bits(crc15(bits), 15)


def crc15(bits: list[int]) -> int:
    """Return the CRC of a frame (ISO 11898-1, 10.4.2.6: polynomial 0x4599)."""
    register = 0
    for bit in bits:
        inverted = bit ^ register >> 14
        register = register << 1 & 0x7FFF
        if inverted:
            register ^= 0x4599
    return register


def stuff_bits(bits: list[int]) -> int:
    """Count the bits that stuffing adds: one after five equal ones, itself the next in line."""
    added, run, last = 0, 0, -1
    for bit in bits:
        run, last = (run + 1, last) if bit == last else (1, bit)
        if run == 5:
            added += 1
            run, last = 1, 1 - bit
    return added


@given(frames())
def test_lengths_bound_every_frame(frame: Frame) -> None:
    """A frame has exactly the bits of the formula, and never more stuffing than its bound."""
    region = stuffed_region(frame)
    size, extended = len(frame.data), frame.is_extended
    tail = 1 + 2 + 7 + 3  # CRC delimiter, acknowledge, end of frame, intermission
    assert len(region) + tail == frame_bits(size, is_extended=extended)
    assert 0 <= stuff_bits(region) <= stuff_bits_worst(size, is_extended=extended)


def test_the_bound_is_reached() -> None:
    """The worst case is no exaggeration for the bits in question: alternating runs of four."""
    bits = [0] * 5 + [bit for run in range(24) for bit in [(run + 1) % 2] * 4]
    assert stuff_bits(bits[:98]) == stuff_bits_worst(8) == 24


@pytest.mark.parametrize('is_extended', [False, True])
@pytest.mark.parametrize('size', [0, 4, 8])
def test_the_mean_is_that_of_random_frames(size: int, is_extended: bool) -> None:
    """Random identifiers and payloads have as many stuff bits as the estimate says."""
    source = random.Random(301)
    count, width, total = 3000, 29 if is_extended else 11, 0
    for _ in range(count):
        can_id, data = source.getrandbits(width), source.randbytes(size)
        total += stuff_bits(stuffed_region(Frame(can_id, data, is_extended=is_extended)))
    # up to one more for the fixed dominant bits (RTR, IDE, r0, the upper ones of a short length)
    assert 0.0 <= total / count - stuff_bits_mean(size, is_extended=is_extended) <= 1.1


def test_a_known_bus_has_the_load_of_a_hand_calculation() -> None:
    """7 axes at 100 Hz: 1 SYNC, 21 TPDOs and 14 RPDOs of 8 bytes each cycle at 1 Mbit/s."""
    load = BusLoad(1_000_000, now=10.0)
    cycle = [Frame(0x80)] + [Frame(0x181, bytes(8))] * 35
    for _ in range(100):
        for frame in cycle:
            load.count(frame)
    figures = load.figures(11.0)
    assert figures.frames_per_second == pytest.approx(3600)
    assert figures.load == pytest.approx((100 * (47 + 33 / 30) + 3500 * (111 + 97 / 30)) / 1e6)


def test_the_window_slides() -> None:
    """Only the last second counts: a bus that went silent shows nothing after it."""
    load = BusLoad(500_000, now=0.0)
    now = 0.0
    for _ in range(30):  # 3 s at 50 frames/s, read every 0.1 s
        for _ in range(5):
            load.count(Frame(1, b'12345678'))
        now += 0.1
        figures = load.figures(now)
    assert figures.frames_per_second == pytest.approx(50.0)
    for _ in range(12):
        now += 0.1
        figures = load.figures(now)
    assert figures.frames_per_second == 0.0
    assert figures.load == 0.0


def test_odd_figures() -> None:
    """Error frames are not on the wire, an empty span has no rate, no bit rate has no load."""
    load = BusLoad(500_000, now=5.0)
    load.count(Frame(0x40, bytes(8), is_error=True))
    assert load.figures(5.0).frames_per_second == 0.0
    assert load.figures(6.0).frames_per_second == 0.0
    for bitrate, window in ((0, 1.0), (-1, 1.0), (1000, 0.0)):
        with pytest.raises(ValueError, match='must be positive'):
            BusLoad(bitrate, 0.0, window)
