# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames as bytes: the vendor's own examples, and what is stated of the new layout."""

from __future__ import annotations

import struct

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_hardware import CodecError
from quad_hardware.protocol import (
    ACTION_RESET,
    Code,
    Frame,
    HOST_KINDS,
    Kind,
    Protocol,
    Register,
    ROBOT_KINDS,
    STATE,
    StreamParser,
    Torque,
    V1,
    V2,
)
from quad_protocol_strategies import frames, PROTOCOLS
from quad_state_frames import state_frame

KINDS = HOST_KINDS | ROBOT_KINDS

# printed in the vendor's documents, or recorded from its library
GOLDEN = [
    (Frame(Kind.WRITE, Register.VX, b'\xff'), '55 00 09 00 30 FF C7 00 AA'),
    (Frame(Kind.WRITE, Register.VX, b'\x80'), '55 00 09 00 30 80 46 00 AA'),
    (Frame(Kind.READ, Register.FIRMWARE, b'\x0a'), '55 00 09 02 07 0A E3 00 AA'),
    (
        Frame(Kind.REPLY, Register.FIRMWARE, b'M-4.3.3\0\0\0'),
        '55 00 12 12 07 4D 2D 34 2E 33 2E 33 00 00 00 64 00 AA',
    ),
    (Frame(Kind.READ, Register.BATTERY, b'\x01'), '55 00 09 02 01 01 F2 00 AA'),
    (Frame(Kind.REPLY, Register.BATTERY, b'\x55'), '55 00 09 12 01 55 8E 00 AA'),
    (Frame(Kind.READ, Register.MOTORS, b'\x0f'), '55 00 09 02 50 0F 95 00 AA'),
    (Frame(Kind.READ, Register.MOTORS, b'\x0c'), '55 00 09 02 50 0C 98 00 AA'),
    (Frame(Kind.READ, Register.IMU, b'\x18'), '55 00 09 02 65 18 77 00 AA'),
    (
        Frame(Kind.WRITE, Register.MOTORS, b'\x80' * 12),
        '55 00 14 00 50' + ' 80' * 12 + ' 9B 00 AA',
    ),
    (Frame(Kind.WRITE, Register.ACTION, bytes((ACTION_RESET,))), '55 00 09 00 3E FF B9 00 AA'),
    (
        Frame(Kind.WRITE, Register.TORQUE, bytes((Torque.UNLOAD_ALL,))),
        '55 00 09 00 20 01 D5 00 AA',
    ),
    (
        Frame(Kind.REPLY, 0x62, struct.pack('<f', 1.5)),
        '55 00 0C 12 62 00 00 C0 3F 80 00 AA',
    ),
]


@pytest.mark.parametrize(('frame', 'text'), GOLDEN)
def test_the_vendors_frames_are_made_and_read(frame: Frame, text: str) -> None:
    """The golden frames of protocol v1, byte for byte, in both directions."""
    wire = bytes.fromhex(text)
    assert frame.encode(V1) == wire
    assert StreamParser(V1, KINDS).feed(wire) == [frame]


def test_the_state_frame_is_as_stated() -> None:
    """254 bytes in all, and the valid attitude at offsets 20 to 31."""
    wire = state_frame(euler2=(1.5, -2.0, 90.0)).encode(V2)
    assert len(wire) == 254
    assert wire[:2] + wire[-2:] == bytes.fromhex('55 00 00 AA')
    assert struct.unpack_from('<3f', wire, 6 + 20) == (1.5, -2.0, 90.0)
    assert V2.wire_time(len(wire)) == pytest.approx(1.27e-3)


def test_feedback_on_is_the_documented_frame() -> None:
    """The example of the assumed layout."""
    wire = Frame(Kind.WRITE, Code.FEEDBACK, b'\x01').encode(V2)
    assert wire == bytes.fromhex('55 00 0A 00 01 03 01 F0 00 AA')


@given(st.data(), PROTOCOLS)
def test_every_frame_survives_its_bytes(data: st.DataObject, protocol: Protocol) -> None:
    """Parsing what was encoded gives the frame back."""
    frame = data.draw(frames(protocol))
    assert StreamParser(protocol, KINDS).feed(frame.encode(protocol)) == [frame]


def test_what_does_not_fit_is_refused_with_the_reason() -> None:
    """Too much payload, a kind the protocol lacks, an address that is too large."""
    with pytest.raises(CodecError, match='takes 247'):
        Frame(Kind.WRITE, 0x50, bytes(248)).encode(V1)
    with pytest.raises(CodecError, match='no frame of kind PUSH'):
        Frame(Kind.PUSH, STATE.address).encode(V1)
    with pytest.raises(CodecError, match='0x110 does not fit protocol v1'):
        Frame(Kind.READ, STATE.address).encode(V1)
