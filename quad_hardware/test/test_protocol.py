# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Frames as bytes: the vendor's own examples, what is stated of the new layout, and the parser.

Any split, any garbage: no valid frame is lost, and every byte is accounted for.
"""

from __future__ import annotations

from collections.abc import Callable
import math
import struct

from hypothesis import given, settings
from hypothesis import strategies as st
import pytest

from quad_hardware import CodecError
from quad_hardware.protocol import (
    ACTION_RESET,
    ANGLE_SPANS,
    BULK_READ_ORDER,
    Code,
    Field,
    Frame,
    Function,
    HOST_KINDS,
    Kind,
    LEG_MOTORS,
    Model,
    model_of_firmware,
    MOTOR_OF_JOINT,
    MOTOR_OF_REGISTER,
    MOTOR_ORDER,
    Protocol,
    Register,
    REGISTER_OF_MOTOR,
    ROBOT_KINDS,
    Scalar,
    scatter,
    slot_of,
    Span,
    STATE,
    StreamParser,
    Torque,
    V1,
    V2,
)
from quad_pty_peer import state_frame

PROTOCOLS = st.sampled_from([V1, V2])
SIDES = st.sampled_from([HOST_KINDS, ROBOT_KINDS])


@st.composite
def frames(draw: st.DrawFn, protocol: Protocol) -> Frame:
    """Any frame of a protocol, also with an address that its table lacks."""
    address = draw(st.integers(0, 256**protocol.address_size - 1))
    payload = draw(st.binary(max_size=protocol.max_length - protocol.overhead))
    return Frame(draw(st.sampled_from(sorted(protocol.kinds))), address, payload)


@st.composite
def cut(draw: st.DrawFn, data: bytes) -> list[bytes]:
    """Data in pieces, cut anywhere."""
    at = sorted(draw(st.lists(st.integers(0, len(data)), max_size=12)))
    return [data[a:b] for a, b in zip([0, *at], [*at, len(data)], strict=True)]


ROWS = [*V1.functions.values(), *V2.functions.values()]
SPANS = [span for row in ROWS for span in row.spans.values()]
FLOATS = st.floats(width=32, allow_nan=False, allow_infinity=False)


def numbers(field: Field) -> st.SearchStrategy[tuple[float, ...]]:
    """Anything that a field can hold."""
    if field.scalar is Scalar.F32:
        one: st.SearchStrategy[float] = FLOATS
    else:
        bits = 8 * field.scalar.size
        signed = field.scalar in {Scalar.I16, Scalar.I16_BE}
        low = -(2 ** (bits - 1)) if signed else 0
        one = st.integers(low, low + 2**bits - 1).map(lambda n: n * field.scale)
    return st.tuples(*[one] * field.count)


@given(st.data(), st.sampled_from(ROWS))
def test_payloads_survive(data: st.DataObject, row: Function) -> None:
    """Decoding what was encoded gives the values back, in every row of both tables."""
    values = {field.name: data.draw(numbers(field)) for field in row.fields}
    assert row.unpack(row.pack(**values)) == values


@given(st.lists(st.tuples(st.integers(0, 255), st.floats(-327, 327)), min_size=1, max_size=16))
def test_groups_follow_each_other(groups: list[tuple[int, float]]) -> None:
    """A repeated row is its groups one by one."""
    row = V2.functions[Code.SERVOS]
    motors, angles = zip(*groups, strict=True)
    one_by_one = [row.pack(motor=(motor,), angle=(angle,)) for motor, angle in groups]
    assert row.pack(motor=motors, angle=angles) == b''.join(one_by_one)


@given(st.sampled_from(SPANS), st.integers(0, 255))
def test_every_byte_of_a_range_comes_back(span: Span, byte: int) -> None:
    """Decoding and encoding a byte changes nothing."""
    assert span.encode(span.decode(byte)) == byte


@given(st.sampled_from(SPANS), st.floats(allow_nan=False))
def test_a_byte_is_the_nearest_one(span: Span, value: float) -> None:
    """What is decoded is half a step off at most, of the value taken into the range.

    0x80 stops, as the vendor's documents say (its library sends 0x7F).
    """
    inside = min(max(value, span.low), span.high)
    step = (span.high - span.low) / 255
    assert abs(span.decode(span.encode(value)) - inside) <= step / 2 * (1 + 1e-9)
    assert V1.functions[Register.VX].spans[Model.LITE].encode(0.0) == 0x80


SERVOS = V2.functions[Code.SERVOS]


@pytest.mark.parametrize(
    ('refused', 'reason'),
    [
        (lambda: SERVOS.pack(motor=(11,)), 'servos: angle missing or unknown'),
        (lambda: SERVOS.pack(motor=(11,), angle=(1.0, 2.0)), 'not as many'),
        (lambda: SERVOS.pack(motor=(12, 11), angle=(1.0, 400.0)), r'servos: .*400.0'),
        (lambda: SERVOS.pack(motor=(12, 11), angle=(1.0, math.nan)), r'servos: .*nan'),
        (lambda: SERVOS.unpack(bytes(4)), 'payload of 4 bytes, not 3'),
        (lambda: Span(-1, 1).encode(math.nan), 'NaN'),
        (lambda: Frame(Kind.WRITE, 0x50, bytes(248)).encode(V1), 'takes 247'),
        (lambda: Frame(Kind.PUSH, STATE.address).encode(V1), 'no frame of kind PUSH'),
        (lambda: Frame(Kind.READ, STATE.address).encode(V1), '0x110 does not fit protocol v1'),
    ],
)
def test_what_does_not_fit_is_refused_by_name(refused: Callable[[], object], reason: str) -> None:
    """Wrong counts, names, values and lengths say what would have been right."""
    with pytest.raises(CodecError, match=reason):
        refused()


def test_motors_registers_and_slots_agree() -> None:
    """Ids, slots and registers map to each other without a gap or a double."""
    assert [slot_of(motor) for motor in MOTOR_ORDER] == list(range(16))
    assert sorted(MOTOR_OF_JOINT.values()) == sorted(MOTOR_ORDER)
    assert {MOTOR_OF_REGISTER[r]: r for r in MOTOR_OF_REGISTER} == REGISTER_OF_MOTOR
    assert [REGISTER_OF_MOTOR[motor] for motor in LEG_MOTORS] == list(range(0x50, 0x5C))
    assert [REGISTER_OF_MOTOR[motor] for motor in (51, 52, 53, 54)] == [0x71, 0x5D, 0x5E, 0x70]
    assert len(BULK_READ_ORDER) == 15
    assert all(ANGLE_SPANS[model].keys() == set(MOTOR_ORDER) for model in Model)
    with pytest.raises(ValueError, match=r'no motor has id 14; there are 11, 12'):
        slot_of(14)


def test_a_long_write_runs_through_the_registers() -> None:
    """Twelve bytes at 0x50 are twelve registers; three at the LED are one."""
    assert list(scatter(0x50, bytes(range(12)))) == [(0x50 + n, bytes((n,))) for n in range(12)]
    assert list(scatter(0x69, b'rgb')) == [(0x69, b'rgb')]


def test_a_firmware_names_the_model() -> None:
    """The first letters decide; a rider is no quadruped."""
    names = {
        'M-4.3.3': Model.MINI, 'L-4.0.1': Model.LITE, 'MW-1.0': Model.WHEELED,
        'W-1.0': Model.WHEELED, 'R-3.0': None, '': None,
    }  # fmt: skip
    assert {name: model_of_firmware(name) for name in names} == names


KINDS = HOST_KINDS | ROBOT_KINDS

# of v1: printed in the vendor's documents, or recorded from its library
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
    (Frame(Kind.REPLY, 0x62, struct.pack('<f', 1.5)), '55 00 0C 12 62 00 00 C0 3F 80 00 AA'),
    # the example of the assumed layout of v2: feedback on
    (Frame(Kind.WRITE, Code.FEEDBACK, b'\x01'), '55 00 0A 00 01 03 01 F0 00 AA'),
]


@pytest.mark.parametrize(('frame', 'text'), GOLDEN)
def test_golden_frames_are_made_and_read(frame: Frame, text: str) -> None:
    """Byte for byte, in both directions."""
    wire, protocol = bytes.fromhex(text), V2 if frame.address == Code.FEEDBACK else V1
    assert frame.encode(protocol) == wire
    assert StreamParser(protocol, KINDS).feed(wire) == [frame]


def test_the_state_frame_is_as_stated() -> None:
    """254 bytes in all, and the valid attitude at offsets 20 to 31."""
    wire = state_frame(euler2=(1.5, -2.0, 90.0)).encode(V2)
    assert len(wire) == 254
    assert wire[:2] + wire[-2:] == bytes.fromhex('55 00 00 AA')
    assert struct.unpack_from('<3f', wire, 6 + 20) == (1.5, -2.0, 90.0)
    assert V2.wire_time(len(wire)) == pytest.approx(1.27e-3)


STATE_WIRE = state_frame(sequence=7).encode(V2)


CUT_SHORT = (b'\x55', b'\x55\x00', b'\x55\x00\xfe', b'\x55\x00\xfe\x12', b'\x55' * 9)


@settings(max_examples=40)
@given(st.data(), PROTOCOLS)
def test_no_valid_frame_is_lost(data: st.DataObject, protocol: Protocol) -> None:
    """Whatever came before, and wherever it is cut: each is found, in order.

    Without garbage at once, else at the latest when the line goes quiet.
    """
    sent = data.draw(st.lists(frames(protocol), min_size=1, max_size=6))
    wire = b''.join(frame.encode(protocol) for frame in sent)
    for garbage in (b'', data.draw(st.binary(max_size=600)), *CUT_SHORT):
        parser = StreamParser(protocol, KINDS)
        received = [f for piece in data.draw(cut(garbage + wire)) for f in parser.feed(piece)]
        if not garbage:
            assert received == sent
            assert parser.counters.skipped == parser.pending == 0
        received += parser.expire()
        assert received[-len(sent) :] == sent, garbage


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
