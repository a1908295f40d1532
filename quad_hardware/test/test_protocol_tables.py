# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The tables: payloads survive, ranges hold, motors and slots agree."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_hardware import CodecError
from quad_hardware.protocol import (
    ANGLE_SPANS,
    BULK_READ_ORDER,
    Code,
    Field,
    Function,
    LEG_MOTORS,
    Model,
    model_of_firmware,
    MOTOR_OF_JOINT,
    MOTOR_OF_REGISTER,
    MOTOR_ORDER,
    Register,
    REGISTER_OF_MOTOR,
    Scalar,
    scatter,
    slot_of,
    Span,
    V1,
    V2,
)
from quad_state_frames import read_state, state_frame

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
    """A repeated row is its groups one by one; what does not fit is refused with its name."""
    row = V2.functions[Code.SERVOS]
    motors, angles = zip(*groups, strict=True)
    one_by_one = [row.pack(motor=(motor,), angle=(angle,)) for motor, angle in groups]
    assert row.pack(motor=motors, angle=angles) == b''.join(one_by_one)
    for wrong in (400.0, math.nan):
        with pytest.raises(CodecError, match='servos'):
            row.pack(motor=(*motors, 11), angle=(*angles, wrong))


@pytest.mark.parametrize('row', ROWS, ids=lambda row: row.name)
def test_fields_do_not_overlap(row: Function) -> None:
    """No byte of a payload belongs to two fields, and the table has no hole but at its end."""
    end = 0
    for field in row.fields:
        assert field.offset == end
        end += field.size
    assert end <= row.length


@given(st.sampled_from(SPANS), st.integers(0, 255))
def test_every_byte_of_a_range_comes_back(span: Span, byte: int) -> None:
    """Decoding and encoding a byte changes nothing."""
    assert span.encode(span.decode(byte)) == byte


@given(st.sampled_from(SPANS), st.floats(allow_nan=False))
def test_a_byte_is_the_nearest_one(span: Span, value: float) -> None:
    """What is decoded is half a step off at most, of the value taken into the range."""
    inside = min(max(value, span.low), span.high)
    step = (span.high - span.low) / 255
    assert abs(span.decode(span.encode(value)) - inside) <= step / 2 * (1 + 1e-9)


def test_zero_of_a_symmetric_range_is_the_neutral_byte() -> None:
    """0x80 stops, as the vendor's documents say (its library sends 0x7F)."""
    assert V1.functions[Register.VX].spans[Model.LITE].encode(0.0) == 0x80


def test_nan_has_no_byte() -> None:
    """NaN is refused, not turned into an end of the range."""
    with pytest.raises(CodecError, match='NaN'):
        Span(-1, 1).encode(math.nan)


def test_a_slot_may_hold_anything() -> None:
    """Of a dead IMU or a motor that is not fitted; the other values are read."""
    slots = (*[1.0] * 15, math.nan)
    read = read_state(state_frame(euler2=(math.nan,) * 3, position=slots, sequence=7))
    assert all(map(math.isnan, (*read.euler2, read.position[15])))
    assert (read.position[:15], read.sequence) == (slots[:15], 7)


def test_refusals_name_row_field_and_need() -> None:
    """Wrong counts, names, values and lengths say what would have been right."""
    servos = V2.functions[Code.SERVOS]
    with pytest.raises(CodecError, match='servos: angle missing or unknown'):
        servos.pack(motor=(11,))
    with pytest.raises(CodecError, match='not as many'):
        servos.pack(motor=(11,), angle=(1.0, 2.0))
    with pytest.raises(CodecError, match=r'servos: .*400.0'):
        servos.pack(motor=(11,), angle=(400.0,))
    with pytest.raises(CodecError, match='payload of 4 bytes, not 3'):
        servos.unpack(bytes(4))
    assert servos.unpack(servos.pack(motor=(11,), angle=(1.5,)) * 2)['motor'] == (11, 11)


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


@pytest.mark.parametrize(
    ('firmware', 'model'),
    [
        ('M-4.3.3', Model.MINI),
        ('L-4.0.1', Model.LITE),
        ('MW-1.0', Model.WHEELED),
        ('W-1.0', Model.WHEELED),
        ('R-3.0', None),
        ('', None),
    ],
)
def test_a_firmware_names_the_model(firmware: str, model: Model | None) -> None:
    """The first letters decide; a rider is no quadruped."""
    assert model_of_firmware(firmware) is model
