# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Constraints of a state: joints, how a link is turned, and where a point of it is."""

from __future__ import annotations

from hypothesis import assume, given
from hypothesis import strategies as st
import numpy as np
import pinocchio as pin
from planning_messages import panda
from planning_scenes import holds
import pytest

from arm_model import Array, Box, Cone, Cylinder, frozen, ORIGIN, PlacedShape, Pose, Sphere
from arm_planning import (
    OrientationConstraint,
    Parameterization,
    PathConstraints,
    PositionConstraint,
)
from arm_planning.constraints import _turned, ConstraintCheck, ConstraintResult, HEEDED, STEP

MODEL = panda().model('panda_arm')
READY = frozen([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
LINK = 'panda_link8'
TIP = MODEL.kinematics.link_pose(LINK, READY)
SHAPES = (Box(0.1, 0.2, 0.3), Sphere(0.1), Cylinder(0.1, 0.3), Cone(0.1, 0.3))
AXES = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array).filter(lambda axis: axis @ axis > 0.01)
OFFSETS = st.tuples(*[st.floats(-0.3, 0.3)] * 3).map(np.array)


def results(constraints: PathConstraints) -> list[ConstraintResult]:
    """Return what becomes of constraints at READY; the first one that is not heeded is named."""
    check = ConstraintCheck(MODEL, constraints)
    found = list(check.results(READY))
    violations = [each.violation for each in found if each.violation]
    assert check.violated(READY) == (violations[0] if violations else '')
    return found


def region(shape: Box | Sphere | Cylinder | Cone, offset: Array) -> PlacedShape:
    """Return a region whose middle is beside the tip."""
    return PlacedShape(shape, Pose(ORIGIN.rotation, frozen(TIP.position + offset)))


def at_tip(*regions: PlacedShape) -> PathConstraints:
    """Return that the tip is in one of some regions."""
    return PathConstraints(positions=[PositionConstraint(LINK, frozen(np.zeros(3)), regions)])


def test_each_constraint_has_its_result() -> None:
    """In the order of joints, orientations and positions, with how far it is beyond."""
    turned = TIP.rotation @ np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    joint, other, turn, place = results(
        PathConstraints(
            {'panda_joint1': (0.3, 0.5), 'panda_joint2': (-1.0, 0.0)},
            [OrientationConstraint(LINK, frozen(turned), frozen([0.1, 0.1, 0.1]))],
            at_tip(region(Sphere(0.1), np.array([0.0, 0.0, 0.25]))).positions,
        )
    )
    assert other == HEEDED
    assert joint.distance == pytest.approx(0.3)
    assert 'panda_joint1 is at 0.0000' in joint.violation
    assert turn.distance == pytest.approx(np.pi / 2 - 0.1)
    assert 'is turned by' in turn.violation
    assert place.distance == pytest.approx(0.15)
    assert f'{LINK} is outside of its region' in place.violation


def test_a_link_may_be_in_any_of_its_regions() -> None:
    """As in MoveIt, where the primitives of one constraint are a union."""
    near, far = region(Sphere(0.05), np.zeros(3)), region(Sphere(0.05), np.array([0.5, 0.0, 0.0]))
    assert results(at_tip(near, far)) == results(at_tip(far, near)) == [HEEDED]
    (outside,) = results(at_tip(far))
    assert outside.distance == pytest.approx(0.45)


@given(st.sampled_from(SHAPES), OFFSETS)
def test_a_region_holds_what_is_inside(
    shape: Box | Sphere | Cylinder | Cone, offset: Array
) -> None:
    """By the definition of each shape, but for rounding at its faces."""
    (result,) = results(at_tip(region(shape, offset)))
    if holds(shape, -offset, -1e-9):
        assert result == HEEDED
    if not holds(shape, -offset, 2e-6):
        assert result.distance > 0.0


@given(AXES, st.floats(0.0, np.pi), AXES, AXES)
def test_how_far_a_link_is_turned_changes_as_its_rows_say(
    axis: Array, angle: float, wanted: Array, turn: Array
) -> None:
    """To half a turn: the gradient, and the room for what happens until the next look."""
    constraint = OrientationConstraint(LINK, frozen(pin.exp3(wanted)), frozen(np.ones(3)))
    turned_by = angle * axis / np.linalg.norm(axis)
    rotation = constraint.rotation @ pin.exp3(turned_by)
    by_turn = np.vstack((np.zeros((3, 3)), np.eye(3)))

    def rows(turn: Array) -> Array:
        pose = Pose(frozen(pin.exp3(turn) @ rotation), TIP.position)
        return _turned(constraint, pose, by_turn)[0].values

    row, _ = _turned(constraint, Pose(frozen(rotation), TIP.position), by_turn)
    assert np.abs(row.values) == pytest.approx(np.abs(turned_by), abs=1e-6)
    until_next = 0.5 * STEP * turn / np.linalg.norm(turn)
    grown = np.abs(rows(until_next)) - np.abs(row.values)
    assert grown.max() <= row.room * (1.0 + 1e-9)
    assume(angle < np.pi - 0.1)
    small = 1e-5 * turn / np.linalg.norm(turn)
    change = 0.5 * (rows(small) - rows(-small))
    assert change == pytest.approx(row.gradients @ small, abs=1e-9)


def about(axis: int, angle: float) -> Array:
    """Return a turn about one axis."""
    vector = np.zeros(3)
    vector[axis] = angle
    return np.asarray(pin.exp3(vector))


@given(st.floats(-3.1, 3.1), st.floats(-1.3, 1.3), st.floats(-3.1, 3.1), AXES, AXES)
def test_euler_angles_are_those_of_moveit_and_change_as_their_rows_say(
    x: float, y: float, z: float, wanted: Array, turn: Array
) -> None:
    """About x, then the new y, then the new z; the gradient, and the room until the next look."""
    constraint = OrientationConstraint(
        LINK, frozen(pin.exp3(wanted)), frozen(np.ones(3)), Parameterization.XYZ_EULER_ANGLES
    )
    rotation = constraint.rotation @ about(0, x) @ about(1, y) @ about(2, z)
    by_turn = np.vstack((np.zeros((3, 3)), np.eye(3)))

    def rows(turn: Array) -> Array:
        pose = Pose(frozen(pin.exp3(turn) @ rotation), TIP.position)
        return _turned(constraint, pose, by_turn)[0].values

    row, _ = _turned(constraint, Pose(frozen(rotation), TIP.position), by_turn)
    assert row.values == pytest.approx([x, y, z], abs=1e-9)
    change = np.abs(rows(0.5 * STEP * turn / np.linalg.norm(turn)) - row.values)
    assert change.max() <= row.room * (1.0 + 1e-6)
    small = 1e-5 * turn / np.linalg.norm(turn)
    change = 0.5 * (rows(small) - rows(-small))
    assert change == pytest.approx(row.gradients @ small, abs=1e-8)


def test_an_angle_of_half_a_turn_is_any_angle() -> None:
    """Also where the angle jumps from one side to the other."""
    for parameterization in Parameterization:
        free = frozen([0.1, 0.1, np.pi])
        rotation = frozen(TIP.rotation @ about(2, np.pi - 1e-4))
        turn = OrientationConstraint(LINK, rotation, free, parameterization)
        assert ConstraintCheck(MODEL, PathConstraints(orientations=[turn])).heeds(READY)
