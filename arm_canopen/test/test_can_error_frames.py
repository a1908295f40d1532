# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Error frames in words."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st
import pytest

from arm_canopen.can import error_text, Frame


@pytest.mark.parametrize(
    ('can_id', 'data', 'text'),
    [
        (0x040, bytes(8), 'bus off'),
        (0x020, bytes(8), 'no acknowledge'),
        (0x004, b'\0\x20' + bytes(6), 'controller problem (transmit error passive)'),
        (
            0x004,
            b'\0\x30' + bytes(6),
            'controller problem (receive error passive, transmit error passive)',
        ),
        (
            0x088,
            b'\0\0\x84' + bytes(5),
            'protocol violation (bit stuffing, on transmission), bus error',
        ),
        (0x004, b'', 'controller problem'),
        (0x240, bytes(6) + b'\x80\x05', 'bus off, 128 transmit and 5 receive errors counted'),
        (0x1000, bytes(8), 'error class 0x1000'),
    ],
)
def test_classes_and_details_are_named(can_id: int, data: bytes, text: str) -> None:
    """What the controller reports is reported as linux/can/error.h defines it."""
    assert error_text(Frame(can_id, data, is_error=True)) == text


@given(st.integers(0, 0x1FFF_FFFF), st.binary(max_size=8))
def test_every_error_frame_has_a_text(can_id: int, data: bytes) -> None:
    """Unknown bits and short frames are reported too, and never crash."""
    assert error_text(Frame(can_id, data, is_error=True))
