# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""States and paths are valid exactly where limits, distances and constraints say so."""

from __future__ import annotations

import math
from typing import Any

from hypothesis import given
from hypothesis import strategies as st
from model_robots import ready, robot
import numpy as np
import pinocchio as pin
from planning_messages import panda
from planning_scenes import DENSE, distances, holds, with_box, with_random_boxes
import pytest

import arm_model as am
from arm_planning import (
    OrientationConstraint,
    Parameterization,
    PathConstraints,
    PositionConstraint,
    ValidityCheck,
)
from arm_planning.constraints import _turned, ConstraintCheck, ConstraintResult, HEEDED, STEP
from arm_planning.validity import MARGIN
from arm_trajectory import build_path, GoalPoint, GoalRules, Path, TrajectoryGoal

MODEL = panda().model('panda_arm')
READY = am.frozen([0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785])
LINK = 'panda_link8'
TIP = MODEL.kinematics.link_pose(LINK, READY)
SHAPES = (am.Box(0.1, 0.2, 0.3), am.Sphere(0.1), am.Cylinder(0.1, 0.3), am.Cone(0.1, 0.3))
AXES = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(np.array).filter(lambda axis: axis @ axis > 0.01)
ANGLES = st.tuples(*(st.floats(-most, most) for most in (3.1, 1.3, 3.1))).map(np.array)
OFFSETS = st.tuples(*[st.floats(-0.3, 0.3)] * 3).map(np.array)


def results(constraints: PathConstraints) -> list[ConstraintResult]:
    """Return what becomes of constraints at READY; the first one that is not heeded is named."""
    check = ConstraintCheck(MODEL, constraints)
    found = list(check.results(READY))
    violations = [each.violation for each in found if each.violation]
    assert check.violated(READY) == (violations[0] if violations else '')
    return found


def about(axis: int, angle: float) -> am.Array:
    """Return a turn about one axis."""
    return np.asarray(pin.exp3(angle * np.eye(3)[axis]))


def region(shape: am.Box | am.Sphere | am.Cylinder | am.Cone, offset: am.Array) -> am.PlacedShape:
    """Return a region whose middle is beside the tip."""
    return am.PlacedShape(shape, am.Pose(am.ORIGIN.rotation, am.frozen(TIP.position + offset)))


def at_tip(*regions: am.PlacedShape) -> PathConstraints:
    """Return that the tip is in one of some regions."""
    return PathConstraints(positions=[PositionConstraint(LINK, am.frozen(np.zeros(3)), regions)])


def test_each_constraint_has_its_result() -> None:
    """In the order of joints, orientations and positions, with how far it is beyond.

    A link may be in any of its regions: as in MoveIt, the primitives are a union.
    """
    near, far = (region(am.Sphere(0.05), np.array([x, 0.0, 0.0])) for x in (0.0, 0.2))
    tight = am.frozen([0.1, 0.1, 0.1])
    joint, other, turn, place = results(
        PathConstraints(
            {'panda_joint1': (0.3, 0.5), 'panda_joint2': (-1.0, 0.0)},
            [OrientationConstraint(LINK, am.frozen(TIP.rotation @ about(2, np.pi / 2)), tight)],
            at_tip(far).positions,
        )
    )
    assert other == HEEDED
    assert joint.distance == pytest.approx(0.3)
    assert 'panda_joint1 is at 0.0000' in joint.violation
    assert turn.distance == pytest.approx(np.pi / 2 - 0.1)
    assert 'is turned by' in turn.violation
    assert place.distance == pytest.approx(0.15)
    assert f'{LINK} is outside of its region' in place.violation
    assert results(at_tip(near, far)) == results(at_tip(far, near)) == [HEEDED]


@given(st.sampled_from(SHAPES), OFFSETS)
def test_a_region_holds_what_is_inside(
    shape: am.Box | am.Sphere | am.Cylinder | am.Cone, offset: am.Array
) -> None:
    """By the definition of each shape, but for rounding at its faces."""
    (result,) = results(at_tip(region(shape, offset)))
    if holds(shape, -offset, -1e-9):
        assert result == HEEDED
    if not holds(shape, -offset, 2e-6):
        assert result.distance > 0.0


@pytest.mark.parametrize('parameterization', Parameterization)
@given(ANGLES, AXES, AXES)
def test_angles_of_a_link_are_those_of_moveit_and_change_as_their_rows_say(
    parameterization: Parameterization, angles: am.Array, wanted: am.Array, turn: am.Array
) -> None:
    """About x, then the new y, then the new z, or a vector, to nearly half a turn.

    The gradient, and the room for what happens until the next look.
    """
    turned_by = pin.exp3(wanted)
    constraint = OrientationConstraint(
        LINK, am.frozen(turned_by), am.frozen(np.ones(3)), parameterization
    )
    if parameterization is Parameterization.XYZ_EULER_ANGLES:
        rotation = turned_by @ about(0, angles[0]) @ about(1, angles[1]) @ about(2, angles[2])
    else:
        angles = angles * min(1.0, 3.04 / max(float(np.linalg.norm(angles)), 1e-9))
        rotation = turned_by @ pin.exp3(angles)
    by_turn = np.vstack((np.zeros((3, 3)), np.eye(3)))

    def row(turn: am.Array) -> Any:
        pose = am.Pose(am.frozen(pin.exp3(turn) @ rotation), TIP.position)
        return _turned(constraint, pose, by_turn)[0]

    here, turn = row(np.zeros(3)), turn / np.linalg.norm(turn)
    if parameterization is Parameterization.XYZ_EULER_ANGLES:
        assert here.values == pytest.approx(angles, abs=1e-9)
    assert np.abs(here.values) == pytest.approx(np.abs(angles), abs=1e-6)
    grown = np.abs(row(0.5 * STEP * turn).values) - np.abs(here.values)
    assert grown.max() <= here.room * (1.0 + 1e-6)
    small = 1e-5 * turn
    change = 0.5 * (row(small).values - row(-small).values)
    assert change == pytest.approx(here.gradients @ small, abs=1e-8)


@pytest.mark.parametrize('parameterization', Parameterization)
def test_an_angle_of_half_a_turn_is_any_angle(parameterization: Parameterization) -> None:
    """Also where the angle jumps from one side to the other."""
    rotation = am.frozen(TIP.rotation @ about(2, np.pi - 1e-4))
    turn = OrientationConstraint(LINK, rotation, am.frozen([0.1, 0.1, np.pi]), parameterization)
    assert ConstraintCheck(MODEL, PathConstraints(orientations=[turn])).heeds(READY)


NEAR = 0.0005  # distance of an arm that nearly touches in [m]
MOTIONS = 40  # straight motions that are compared with a dense sampler in each scene
TOUCH = 1e-3  # how deep a wire is touched in [m]
SWING = [am.frozen(ready('panda') + turn * np.eye(7)[0]) for turn in (-0.8, 0.8)]


@pytest.mark.parametrize('seed', range(8))
def test_a_state_is_valid_where_no_pair_overlaps(seed: int) -> None:
    """The answer is that of the distances, on random states."""
    model = robot('panda')
    scene = with_random_boxes(model, 6, seed)
    check = ValidityCheck(model.limits, scene)
    draw = np.random.default_rng(seed)
    for state in draw.uniform(model.limits.lower, model.limits.upper, (40, 7)):
        touching = bool((distances(scene, state) < 0.0).any())
        assert (check.state(state) is not None) == touching


BALL = '<collision><geometry><sphere radius="0.001"/></geometry></collision>'
CART = (
    f'<robot name="cart"><link name="base"/><link name="cart">{BALL}</link>'
    '<joint name="x" type="prismatic"><parent link="base"/><child link="cart"/><axis xyz="1 0 0"/>'
    '<limit lower="-2" upper="2" velocity="1" effort="1"/></joint></robot>'
)
"""A ball on a rail: its distance rate bound is exact, a straight line has no reserve."""


def path_to(model: am.RobotModel, begin: am.Array, end: am.Array) -> Path:
    """Return a straight motion of four seconds."""
    goal = TrajectoryGoal(model.joints, [GoalPoint(4.0, end.tolist())])
    return build_path(goal, model.limits, am.RobotState.at_rest(begin), GoalRules()).path


@pytest.mark.parametrize('at', np.linspace(-0.93, 0.95, 12).tolist())
def test_a_pin_beside_the_rail_is_not_passed(at: float) -> None:
    """It overlaps by half a millimetre, wherever it stands; a second pin is near elsewhere."""
    group = '<group name="arm"><chain base_link="base" tip_link="cart"/></group>'
    limits = {'x': {'max_acceleration': 2.0, 'max_jerk': 20.0}}
    model = am.RobotModel(CART, f'<robot name="cart">{group}</robot>', limits)
    scene = model.scene
    for name, place in (('pin', (at, 0.0, 0.0015)), ('other', (-at, 0.02, 0.0))):
        pose = am.Pose(am.ORIGIN.rotation, am.frozen(place))
        scene = scene.with_object(am.CollisionObject(name, am.Sphere(0.001), pose=pose))
    check, ends = ValidityCheck(model.limits, scene), np.array([[-1.0], [1.0]])
    assert check.waypoints(ends) is not None
    assert check.path(path_to(model, *ends)) is not None


def test_a_path_between_states_in_near_contact_is_found_valid() -> None:
    """An arm that stands half a millimetre from a wall may leave it."""
    model = robot('panda')
    here, away = ready('panda').copy(), ready('panda').copy()
    away[1] -= 0.5
    near, far = 0.3, 2.0  # of the wall's middle: halved until the wall is half a millimetre away
    for _ in range(40):
        middle = 0.5 * (near + far)
        scene = with_box(model.scene, 'wall', (0.02, 1.0, 1.0), (middle, 0.0, 0.5))
        distance = float(distances(scene, here).min())
        near, far = (near, middle) if distance > NEAR else (middle, far)
    assert distance == pytest.approx(NEAR, abs=1e-4)
    assert ValidityCheck(model.limits, scene).waypoints(np.array((here, away))) is None


def scenes() -> dict[str, am.PlanningScene]:
    """Return the Panda over a half-space, beside a mesh, and with a box in its hand."""
    model, draw = robot('panda'), np.random.default_rng(1)
    points = draw.uniform(-0.2, 0.2, (30, 3)) + np.array((0.5, 0.0, 0.5))
    rock, ground = am.CollisionObject('rock', am.Mesh(points)), am.Plane(offset=-0.05)
    below = model.pose(ready('panda')).position - np.array((0.0, 0.0, 0.1))
    loaded = with_box(
        with_random_boxes(model, 4, 3), 'load', (0.1, 0.1, 0.2), tuple(below.tolist())
    )
    return {
        'plane': model.scene.with_object(am.CollisionObject('ground', ground)),  # no box about it
        'hull': model.scene.with_object(rock),
        'carried': loaded.attached('load', model.tip, ready('panda'), touch_links=['panda_hand']),
    }


def deepest_on(begin: am.Array, end: am.Array, scene: am.PlanningScene) -> float:
    """Return the least distance on a straight motion in [m], as a dense sampler finds it."""
    count = math.ceil(float(np.abs(end - begin).max()) / DENSE)
    return float(distances(scene, np.linspace(begin, end, count)).min())


@pytest.mark.parametrize('scene', scenes().values(), ids=scenes())
def test_a_straight_motion_is_clear_where_a_dense_sampler_finds_room(
    scene: am.PlanningScene,
) -> None:
    """Nothing passes that touches between two looks, and nothing is refused that has room."""
    check = ValidityCheck(robot('panda').limits, scene)
    required = check.required(ready('panda'))
    draw = np.random.default_rng(5)
    answers: list[bool] = []
    while len(answers) < MOTIONS:
        begin = ready('panda') + draw.uniform(-0.4, 0.4, 7)
        end = begin + draw.uniform(-1.2, 1.2, 7)
        if check.state(begin) is not None:
            continue
        least = deepest_on(begin, end, scene)
        clear = check.near(begin, end, required) is None
        if clear:
            assert least > 0.0
        if least > MARGIN:
            assert clear
        answers.append(clear)
    assert 0.1 < np.mean(answers) < 0.9


@pytest.mark.parametrize('angle', np.linspace(-0.75, 0.75, 12))
def test_a_touch_in_passing_is_found(angle: float) -> None:
    """Of a wire that the turning arm touches by a millimetre, however short that is; by name."""
    model, (begin, end) = robot('panda'), SWING
    assert ValidityCheck(model.limits, model.scene).waypoints(np.array(SWING)) is None
    near, far = 0.3, 1.0  # distance of the wire from the axis: halved until it is touched so
    for _ in range(14):
        middle = 0.5 * (near + far)
        at = (middle * math.cos(angle), middle * math.sin(angle), 0.55)
        scene = with_box(model.scene, 'wire', (0.001, 0.001, 0.3), at)
        touched = deepest_on(begin, end, scene) < -TOUCH
        near, far = (middle, far) if touched else (near, middle)
    check = ValidityCheck(model.limits, scene)
    assert check.near(begin, end, check.required(begin, end)) is not None
    path = path_to(model, begin, end)
    between, found = check.waypoints(np.array(SWING)), check.path(path)
    assert between is not None
    assert found is not None
    assert 'wire' in between.reason
    assert 'wire' in found.reason
    assert 0.0 < found.time < path.duration
    assert np.allclose(path.at(found.time).position, found.positions)
