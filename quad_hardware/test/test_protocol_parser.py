# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The parser: any split, any garbage, no valid frame lost, every byte accounted for."""

from __future__ import annotations

import random

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_hardware.protocol import (
    Frame,
    HOST_KINDS,
    Kind,
    Protocol,
    ROBOT_KINDS,
    StreamParser,
    V1,
    V2,
)
from quad_protocol_strategies import cut, frames, PROTOCOLS
from quad_state_frames import state_frame

pytestmark = pytest.mark.slow

KINDS = HOST_KINDS | ROBOT_KINDS
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
