# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Laws of rotations."""

from __future__ import annotations

import math

from hypothesis import given
from hypothesis import strategies as st
import pytest

from quad_description.rotations import (
    about,
    about_z,
    axes_from_rpy,
    conjugate,
    down_in_body,
    from_rpy,
    multiply,
    normalized,
    Quaternion,
    roll_pitch_yaw,
    rotate,
    rotation_vector,
    tilt_of,
    Vector,
    yaw_of,
)

ANGLES = st.floats(-3.1, 3.1)
ROTATIONS = st.builds(from_rpy, ANGLES, st.floats(-1.5, 1.5), ANGLES)
VECTORS = st.tuples(*[st.floats(-10, 10)] * 3)


@given(ROTATIONS, ROTATIONS, VECTORS)
def test_rotations_are_a_group_that_acts(a: Quaternion, b: Quaternion, v: Vector) -> None:
    """One after the other is their product; the inverse undoes."""
    assert rotate(multiply(a, b), v) == pytest.approx(rotate(a, rotate(b, v)), abs=1e-9)
    assert rotate(conjugate(a), rotate(a, v)) == pytest.approx(v, abs=1e-9)


@given(ANGLES, st.floats(-1.5, 1.5), ANGLES, VECTORS)
def test_angles_turn_about_fixed_axes(roll: float, pitch: float, yaw: float, v: Vector) -> None:
    """First x, then y, then z (REP 103); the yaw comes back."""
    rotation = from_rpy(roll, pitch, yaw)
    step = rotate(from_rpy(roll, 0, 0), v)
    step = rotate(from_rpy(0, pitch, 0), step)
    assert rotate(rotation, v) == pytest.approx(rotate(about_z(yaw), step), abs=1e-9)
    assert math.remainder(yaw_of(rotation) - yaw, math.tau) == pytest.approx(0, abs=1e-9)
    axes = axes_from_rpy(roll, pitch, yaw)
    units = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    for axis, unit in zip(axes, units, strict=True):
        assert axis == pytest.approx(rotate(rotation, unit), abs=1e-9)


@given(st.tuples(*[st.floats(-1, 1)] * 3))
def test_a_rotation_vector_is_axis_times_angle(vector: Vector) -> None:
    """Also for a rotation by nothing."""
    angle = math.hypot(*vector)
    x, y, z = (part / angle for part in vector) if angle > 1e-9 else (0.0, 0.0, 1.0)
    spun = about((x, y, z), angle)
    assert rotation_vector(spun) == pytest.approx(vector, abs=1e-6)


@given(ANGLES, st.floats(-1.5, 1.5), ANGLES, st.floats(0.9, 1.1))
def test_angles_come_back(roll: float, pitch: float, yaw: float, length: float) -> None:
    """Also of a quaternion that is not quite one."""
    x, y, z, w = from_rpy(roll, pitch, yaw)
    rotation = normalized((length * x, length * y, length * z, length * w))
    for found, angle in zip(roll_pitch_yaw(rotation), (roll, pitch, yaw), strict=True):
        assert math.remainder(found - angle, math.tau) == pytest.approx(0.0, abs=1e-6)


@given(ROTATIONS)
def test_down_and_tilt_are_those_of_the_vertical(rotation: Quaternion) -> None:
    """Gravity seen from the body, and how far it leans."""
    down = rotate(conjugate(rotation), (0.0, 0.0, -1.0))
    assert down_in_body(rotation) == pytest.approx(down, abs=1e-9)
    assert math.cos(tilt_of(rotation)) == pytest.approx(-down[2], abs=1e-9)
