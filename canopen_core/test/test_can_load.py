# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The bus load against hand calculations."""

from __future__ import annotations

import pytest

from canopen_core.can import BusLoad, Frame, frame_bits, stuff_bits_mean, stuff_bits_worst


@pytest.mark.parametrize(
    ('size', 'is_extended', 'bits', 'worst', 'mean'),
    [
        (0, False, 47, 8, 1.1),
        (8, False, 111, 24, 3.2),
        (0, True, 67, 13, 1.8),
        (8, True, 131, 29, 3.9),
    ],
)
def test_the_length_of_a_frame(
    size: int, is_extended: bool, bits: int, worst: int, mean: float
) -> None:
    """From the start of frame to the intermission (ISO 11898-1, 10.4), and its stuff bits.

    The greatest number of them is one in four bits, that of random content one in 30.
    """
    assert frame_bits(size, is_extended=is_extended) == bits
    assert stuff_bits_worst(size, is_extended=is_extended) == worst
    assert stuff_bits_mean(size, is_extended=is_extended) == pytest.approx(mean, abs=0.05)


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
