# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames as bytes: the vendor's own examples, what is stated of the new layout, and the parser.

Any split, any garbage: no valid frame is lost, and every byte is accounted for.
"""

from __future__ import annotations

import random
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
from quad_protocol_strategies import cut, frames, PROTOCOLS
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


STATE_WIRE = state_frame(sequence=7).encode(V2)


@given(st.data(), PROTOCOLS)
def test_a_stream_may_be_cut_anywhere(data: st.DataObject, protocol: Protocol) -> None:
    """Frames come out in order, whatever the pieces in which they arrive."""
    sent = data.draw(st.lists(frames(protocol), max_size=6))
    parser = StreamParser(protocol, KINDS)
    wire = b''.join(frame.encode(protocol) for frame in sent)
    received = [f for piece in data.draw(cut(wire)) for f in parser.feed(piece)]
    assert received == sent
    assert parser.counters.skipped == parser.pending == 0


@given(st.data(), PROTOCOLS)
def test_no_valid_frame_behind_garbage_is_lost(data: st.DataObject, protocol: Protocol) -> None:
    """Whatever came before, a frame is found, at the latest when the line goes quiet."""
    garbage = data.draw(
        st.binary(max_size=40)
        | st.sampled_from(
            [b'\x55', b'\x55\x00', b'\x55\x00\xfe', b'\x55\x00\xfe\x12', b'\x55' * 9]
        )
    )
    sent = data.draw(st.lists(frames(protocol), min_size=1, max_size=3))
    wire = b''.join(frame.encode(protocol) for frame in sent)
    parser = StreamParser(protocol, KINDS)
    received = [f for piece in data.draw(cut(garbage + wire)) for f in parser.feed(piece)]
    received += parser.expire()
    assert received[-len(sent) :] == sent


@given(st.data(), PROTOCOLS)
def test_every_byte_is_accounted_for(data: st.DataObject, protocol: Protocol) -> None:
    """Bytes fed are bytes of frames, skipped or still waiting."""
    pieces = data.draw(
        st.lists(st.binary(max_size=60) | frames(protocol).map(lambda f: f.encode(protocol)))
    )
    parser = StreamParser(protocol, KINDS)
    found = [frame for piece in pieces for frame in parser.feed(piece)]
    in_frames = sum(len(frame.encode(protocol)) for frame in found)
    counters = parser.counters
    assert counters.bytes == in_frames + counters.skipped + parser.pending
    assert counters.frames == len(found)


@given(st.binary(max_size=400), PROTOCOLS)
def test_pieces_make_no_difference(data: bytes, protocol: Protocol) -> None:
    """One byte at a time gives what all at once gives, counters included."""
    whole, single = StreamParser(protocol, KINDS), StreamParser(protocol, KINDS)
    at_once = whole.feed(data)
    one_by_one = [frame for byte in data for frame in single.feed(bytes((byte,)))]
    assert at_once == one_by_one
    assert whole.counters == single.counters


@pytest.mark.parametrize('protocol', [V1, V2], ids=lambda protocol: protocol.name)
def test_a_megabyte_of_noise_is_survived(protocol: Protocol) -> None:
    """1 MB of random bytes with frames in between: every frame comes out, memory stays small."""
    rng = random.Random(1)
    parser = StreamParser(protocol, ROBOT_KINDS)
    frame = Frame(Kind.REPLY, 1, b'\x55\x00\xaa')
    found = []
    for _ in range(256):
        found += parser.feed(rng.randbytes(4096))
        found += parser.feed(frame.encode(protocol))
        found += parser.expire()
        assert parser.pending == 0
    assert found.count(frame) == 256
    assert parser.counters.skipped == 256 * 4096


def test_the_worst_noise_costs_no_memory() -> None:
    """A stream of nothing but headers keeps less than a frame."""
    parser = StreamParser(V2, KINDS)
    for noise in (b'\x55\x00' * 5000, b'\x55' * 5000, b'\x55\x00\xfe\x20' * 5000):
        parser.feed(noise)
        assert parser.pending < 255


@given(st.integers(0, 253), st.integers(1, 255))
def test_a_flipped_byte_costs_one_frame_only(position: int, flip: int) -> None:
    """Between two whole frames, a damaged one is dropped and nothing else."""
    damaged = bytearray(STATE_WIRE)
    damaged[position] ^= flip
    parser = StreamParser(V2, ROBOT_KINDS)
    found = parser.feed(STATE_WIRE + bytes(damaged) + STATE_WIRE) + parser.expire()
    assert found == [state_frame(sequence=7)] * 2
    assert parser.counters.skipped == len(STATE_WIRE)


def test_the_other_sides_frames_are_no_frames() -> None:
    """A host that receives its own echo does not take it for an answer."""
    parser = StreamParser(V1, ROBOT_KINDS)
    assert parser.feed(Frame(Kind.READ, 1, b'\x01').encode(V1)) == []
    assert parser.counters.bad_kind == 1
