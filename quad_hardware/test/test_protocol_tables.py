# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The tables: payloads survive, ranges hold, motors and slots agree, the page is up to date."""

from __future__ import annotations

from dataclasses import replace
import math
from pathlib import Path

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_hardware import CodecError
from quad_hardware.protocol import (
    ANGLE_SPANS,
    BULK_READ_ORDER,
    Code,
    decode_feedback,
    Feedback,
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
from quad_hardware.protocol.page import protocol_page

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


@pytest.mark.slow
@given(st.lists(st.tuples(st.integers(0, 255), st.floats(-327, 327)), min_size=1, max_size=16))
def test_groups_in_one_go_are_groups_one_by_one(groups: list[tuple[int, float]]) -> None:
    """The same bytes; and what does not fit is refused by the name of the row."""
    row = V2.functions[Code.SERVOS]
    one_by_one = [row.pack(motor=(motor,), angle=(angle,)) for motor, angle in groups]
    assert row.pack_groups(groups) == b''.join(one_by_one)
    for wrong in (400.0, math.nan):
        with pytest.raises(CodecError, match='servos'):
            row.pack_groups([*groups, (11, wrong)])


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


@pytest.mark.slow
@given(
    st.builds(
        Feedback,
        battery=st.integers(0, 100),
        device_time=st.integers(0, 2**32 - 1),
        attitude=st.tuples(FLOATS, FLOATS, FLOATS),
        position=st.tuples(*[FLOATS] * 16),
        velocity=st.tuples(*[FLOATS] * 16),
        sequence=st.integers(0, 2**16 - 1),
    )
)
def test_a_state_survives_its_frame(state: Feedback) -> None:
    """Acceleration is the only field here whose default has no exact float32."""
    state = replace(state, acceleration=(0.0, 0.25, 9.5))
    assert decode_feedback(state.frame().payload) == state


def test_the_joints_of_a_robot_with_a_dead_imu_are_read() -> None:
    """An attitude that is no number is handed on as it is; the other fields count."""
    slots = tuple(float(slot) for slot in range(16))
    read = decode_feedback(Feedback(attitude=(math.nan,) * 3, position=slots).frame().payload)
    assert all(map(math.isnan, read.attitude))
    assert read.position == slots


def test_a_slot_may_hold_anything() -> None:
    """Of a motor that is not fitted; the other slots are read."""
    slots = (*[1.0] * 15, math.nan)
    read = decode_feedback(Feedback(position=slots, velocity=slots).frame().payload)
    for values in (read.position, read.velocity):
        assert values[:15] == slots[:15]
        assert math.isnan(values[15])


def test_refusals_name_row_field_and_need() -> None:
    """Wrong counts, names, values and lengths say what would have been right."""
    servos = V2.functions[Code.SERVOS]
    with pytest.raises(CodecError, match='servos: angle missing or unknown'):
        servos.pack(motor=(11,))
    with pytest.raises(CodecError, match='angle: 2 values given, 1 needed'):
        servos.pack(motor=(11,), angle=(1.0, 2.0))
    with pytest.raises(CodecError, match=r'angle: .400.0,. does not fit I16'):
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


def test_the_protocol_page_is_up_to_date() -> None:
    """PROTOCOL.md is what the tables say."""
    page = Path(__file__).parents[1] / 'PROTOCOL.md'
    assert page.read_text(encoding='utf-8') == protocol_page(), (
        'write it anew: ros2 run quad_hardware protocol > PROTOCOL.md'
    )
