# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The quick check of the search agrees with the distances of the scene."""

from __future__ import annotations

import math

from model_robots import ready, robot
import numpy as np
from planning_scenes import DENSE, distances, with_box, with_random_boxes
import pytest

from arm_model import Array, CollisionObject, Mesh, Plane, PlanningScene, RobotState
from arm_planning import ValidityCheck
from arm_planning.free.motion_check import MotionCheck
from arm_planning.validity import MARGIN
from arm_trajectory import build_path, GoalPoint, GoalRules, TrajectoryGoal

MOTIONS = 40  # straight motions that are compared with a dense sampler in each scene
TOUCH = 1e-3  # how deep a wire is touched in [m]


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
def test_what_overlaps_is_not_free(scene: PlanningScene) -> None:
    """And what is farther apart than the margin is free."""
    model = robot('panda')
    check = MotionCheck(ValidityCheck(model.limits, scene), [ready('panda')])
    touching = 0
    for state in np.random.default_rng(4).uniform(
        model.limits.lower, model.limits.upper, (300, 7)
    ):
        distance = float(distances(scene, state).min())
        if distance < 0.0:
            assert not check.free(state)
            touching += 1
        elif distance > 1.1 * MARGIN:
            assert check.free(state)
    assert touching > 10


@pytest.mark.parametrize('scene', [plane(), hull(), carried()], ids=['plane', 'hull', 'carried'])
def test_a_straight_motion_is_clear_where_a_dense_sampler_finds_room(scene: PlanningScene) -> None:
    """Nothing passes that touches between two looks, and nothing is refused that has room."""
    check = MotionCheck(ValidityCheck(robot('panda').limits, scene), [ready('panda')])
    draw = np.random.default_rng(5)
    answers: list[bool] = []
    while len(answers) < MOTIONS:
        begin = ready('panda') + draw.uniform(-0.4, 0.4, 7)
        end = begin + draw.uniform(-1.2, 1.2, 7)
        if not check.free(begin):
            continue
        least = deepest_on(begin, end, scene)
        clear = check.clear(begin, end)
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
    assert not MotionCheck(check, [begin, end]).clear(begin, end)
    goal = TrajectoryGoal(model.joints, [GoalPoint(3.0, end.tolist())])
    path = build_path(goal, model.limits, RobotState.at_rest(begin), GoalRules()).path
    assert check.path(path) is not None
