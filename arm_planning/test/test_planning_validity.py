# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""States and paths are valid exactly where limits and distances say so."""

from __future__ import annotations

import math

from model_robots import ready, robot
import numpy as np
from planning_scenes import DENSE, distances, with_box, with_random_boxes
import pytest

from arm_model import (
    Array,
    CollisionObject,
    frozen,
    Mesh,
    ORIGIN,
    Plane,
    PlanningScene,
    Pose,
    RobotModel,
    RobotState,
    Sphere,
)
from arm_planning import ValidityCheck
from arm_planning.validity import MARGIN
from arm_trajectory import build_path, GoalPoint, GoalRules, TrajectoryGoal

THIN = 0.002  # thickness of a sheet in [m], which coarse sampling would pass through
NEAR = 0.0005  # distance of an arm that nearly touches in [m]
MOTIONS = 40  # straight motions that are compared with a dense sampler in each scene
TOUCH = 1e-3  # how deep a wire is touched in [m]


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


@pytest.mark.parametrize('at', np.linspace(-0.93, 0.95, 12).tolist())
def test_a_pin_beside_the_rail_is_not_passed(at: float) -> None:
    """It overlaps by half a millimetre, wherever it stands; a second pin is near elsewhere."""
    group = '<group name="arm"><chain base_link="base" tip_link="cart"/></group>'
    limits = {'x': {'max_acceleration': 2.0, 'max_jerk': 20.0}}
    model = RobotModel(CART, f'<robot name="cart">{group}</robot>', limits)
    scene = model.scene
    for name, place in (('pin', (at, 0.0, 0.0015)), ('other', (-at, 0.02, 0.0))):
        pose = Pose(ORIGIN.rotation, frozen(place))
        scene = scene.with_object(CollisionObject(name, Sphere(0.001), pose=pose))
    check = ValidityCheck(model.limits, scene)
    begin = np.array([-1.0])
    goal = TrajectoryGoal(model.joints, [GoalPoint(4.0, [1.0])])
    path = build_path(goal, model.limits, RobotState.at_rest(begin), GoalRules()).path
    assert check.waypoints(np.array((begin, [1.0]))) is not None
    assert check.path(path) is not None


def test_a_thin_sheet_is_not_passed_through() -> None:
    """However thin it is: there is no place between two measurements."""
    model = robot('panda')
    begin, end = ready('panda').copy(), ready('panda').copy()
    begin[0], end[0] = -0.8, 0.8
    assert ValidityCheck(model.limits, model.scene).waypoints(np.array((begin, end))) is None
    scene = with_box(model.scene, 'sheet', (2.0, THIN, 2.0), (1.2, 0.0, 0.5))
    check = ValidityCheck(model.limits, scene)
    assert check.state(begin) is None
    assert check.state(end) is None
    violation = check.waypoints(np.array((begin, end)))
    assert violation is not None
    assert 'sheet' in violation.reason
    points = [GoalPoint(3.0, end.tolist())]
    goal, state = TrajectoryGoal(model.joints, points), RobotState.at_rest(begin)
    path = build_path(goal, model.limits, state, GoalRules()).path
    found = check.path(path)
    assert found is not None
    assert 0.0 < found.time < path.duration
    assert np.allclose(path.at(found.time).position, found.positions)


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


def plane() -> PlanningScene:
    """The panda over a half-space, which has no box about it."""
    model = robot('panda')
    return model.scene.with_object(CollisionObject('ground', Plane(offset=-0.05)))


def hull() -> PlanningScene:
    """The panda beside a mesh."""
    points = np.random.default_rng(1).uniform(-0.2, 0.2, (30, 3)) + np.array((0.5, 0.0, 0.5))
    return robot('panda').scene.with_object(CollisionObject('rock', Mesh(points)))


def carried() -> PlanningScene:
    """The panda with a box in its hand, among boxes."""
    model = robot('panda')
    at = tuple((model.pose(ready('panda')).position - np.array((0.0, 0.0, 0.1))).tolist())
    scene = with_box(with_random_boxes(model, 4, 3), 'load', (0.1, 0.1, 0.2), at)
    return scene.attached('load', model.tip, ready('panda'), touch_links=['panda_hand'])


@pytest.mark.parametrize('scene', [plane(), hull(), carried()], ids=['plane', 'hull', 'carried'])
def test_a_straight_motion_is_clear_where_a_dense_sampler_finds_room(scene: PlanningScene) -> None:
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


def deepest_on(begin: Array, end: Array, scene: PlanningScene) -> float:
    """Return the least distance on a straight motion in [m], as a dense sampler finds it."""
    count = math.ceil(float(np.abs(end - begin).max()) / DENSE)
    return float(distances(scene, np.linspace(begin, end, count)).min())


@pytest.mark.parametrize('angle', np.linspace(-0.75, 0.75, 12))
def test_a_touch_in_passing_is_found(angle: float) -> None:
    """Of a wire that the turning arm touches by a millimetre, however short that is."""
    model, begin, end = robot('panda'), ready('panda').copy(), ready('panda').copy()
    begin[0], end[0] = -0.8, 0.8
    near, far = 0.3, 1.0  # distance of the wire from the axis: halved until it is touched so
    for _ in range(20):
        middle = 0.5 * (near + far)
        at = (middle * math.cos(angle), middle * math.sin(angle), 0.55)
        scene = with_box(model.scene, 'wire', (0.001, 0.001, 0.3), at)
        touched = deepest_on(begin, end, scene) < -TOUCH
        near, far = (middle, far) if touched else (near, middle)
    check = ValidityCheck(model.limits, scene)
    assert check.near(begin, end, check.required(begin, end)) is not None
    goal = TrajectoryGoal(model.joints, [GoalPoint(3.0, end.tolist())])
    path = build_path(goal, model.limits, RobotState.at_rest(begin), GoalRules()).path
    assert check.path(path) is not None
