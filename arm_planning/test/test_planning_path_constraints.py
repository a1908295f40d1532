# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motions with path constraints: they hold everywhere, or there is no motion, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
import os

from model_robots import ready, robot, ROBOTS
import numpy as np
import pinocchio as pin
from planning_scenes import (
    broken_limits,
    deepest_overlap,
    dense_times,
    holds,
    near,
    with_random_boxes,
)
import pytest

import arm_model as am
import arm_planning as ap
from arm_planning.constraints import ConstraintCheck

pytestmark = pytest.mark.slow

SEEDS = range(int(os.environ.get('PLANNING_SEEDS', '1')))
"""Of the random scenes; more of them by the environment."""

TIMEOUT = 60.0  # time for planning in [s]: a busy machine is no failure
OVERLAP_TOLERANCE = 1e-6  # overlap that counts as rounding in [m]
FREE_TURN = 4.0  # tolerance of an axis about which a link may turn as it likes in [rad]
EDGE = 1e-9  # of a constraint, for rounding, in [m] and [rad]

APART, AROUND = 1.0, 0.9
"""How far start and goal are apart at least, and from the ready pose at most, in [rad]."""


def level(model: am.RobotModel, behind: float = 0.0) -> ap.PathConstraints:
    """Keep a cup level: turned about its axis only, which is that of the tool at ready.

    Args:
        behind: How far about that axis it begins away, in [rad].
    """
    upright = model.pose(ready(model.name)).rotation
    wanted = am.frozen(upright @ pin.exp3(np.array([0.0, 0.0, behind])))
    turn = ap.OrientationConstraint(model.tip, wanted, am.frozen([0.1, 0.1, FREE_TURN]))
    return ap.PathConstraints(orientations=[turn])


def in_a_slab(model: am.RobotModel) -> ap.PathConstraints:
    """Keep a point before the tip at a height: in a flat box, or in a cylinder beside it."""
    pose = model.pose(ready(model.name))
    offset = am.frozen([0.0, 0.0, 0.05])
    place = am.Pose(am.ORIGIN.rotation, am.frozen(pose.position + pose.rotation @ offset))
    low = am.Pose(am.ORIGIN.rotation, am.frozen(place.position - [0.0, 0.0, 5.0]))
    regions = [
        am.PlacedShape(am.Box(4.0, 4.0, 0.08), place),
        am.PlacedShape(am.Cylinder(0.1, 0.1), low),
    ]
    return ap.PathConstraints(positions=[ap.PositionConstraint(model.tip, offset, regions)])


def by_joints(model: am.RobotModel) -> ap.PathConstraints:
    """Keep two joints near ready, and the cup level besides, by its Euler angles."""
    at = dict(zip(model.joints, ready(model.name).tolist(), strict=True))
    first, second = model.joints[:2]
    joints = {name: (at[name] - 0.4, at[name] + 0.3) for name in (first, second)}
    (turn,) = level(model).orientations
    euler = replace(turn, parameterization=ap.Parameterization.XYZ_EULER_ANGLES)
    return ap.PathConstraints(joints, [euler])


def broken(model: am.RobotModel, constraints: ap.PathConstraints, state: am.Array) -> list[str]:
    """Return which constraints of the tip a state breaks, by their definitions."""
    found = []
    pose = model.pose(state)
    at = dict(zip(model.joints, state.tolist(), strict=True))
    for name, (lower, upper) in constraints.joints.items():
        if not lower - EDGE <= at[name] <= upper + EDGE:
            found.append(f'{name} at {at[name]}')
    for turn in constraints.orientations:
        off = pin.log3(turn.rotation.T @ pose.rotation)
        if turn.parameterization is ap.Parameterization.XYZ_EULER_ANGLES:
            (_, _, y), (_, _, x), (_, _, w) = (turn.rotation.T @ pose.rotation).tolist()
            off = np.array([np.arctan2(-x, w), np.arcsin(np.clip(y, -1.0, 1.0)), 0.0])
        if (np.abs(off) > turn.tolerance + EDGE).any():
            found.append(f'turned by {off}')
    for place in constraints.positions:
        point = pose.position + pose.rotation @ place.offset
        local = [(each.shape, am.inverse(each.pose)) for each in place.regions]
        if not any(holds(s, p.position + p.rotation @ point, EDGE) for s, p in local):  # type: ignore[arg-type]
            found.append(f'{point} is in no region')
    return found


def ends(
    model: am.RobotModel, check: ConstraintCheck, planner: ap.Planner, seed: int
) -> tuple[am.Array, am.Array]:
    """Return two states far apart that are valid and heed constraints."""
    draw, found = np.random.default_rng(seed), list[am.Array]()
    scene = with_random_boxes(model, 5, seed)
    while len(found) < 2:
        drawn = ready(model.name) + draw.uniform(-AROUND, AROUND, len(model))
        state = check.projected(np.clip(drawn, model.limits.lower, model.limits.upper))
        if state is None or planner.is_valid(state, scene) is not None:
            continue
        if not found or np.linalg.norm(state - found[0]) > APART:
            found.append(am.frozen(state))
    return found[0], found[1]


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize(
    'constraints_of', [level, partial(level, behind=2.9), in_a_slab, by_joints]
)
@pytest.mark.parametrize('seed', SEEDS)
def test_path_constraints_hold_everywhere(
    name: str, constraints_of: Callable[[am.RobotModel], ap.PathConstraints], seed: int
) -> None:
    """In random scenes, looked at every milliradian; limits and distances hold as ever."""
    model = robot(name)
    scene, constraints = with_random_boxes(model, 5, seed), constraints_of(model)
    check, planner = ConstraintCheck(model, constraints), ap.Planner(model, seed=seed)
    start, goal = ends(model, check, planner, seed)
    asked = ap.MotionRequest(start, [ap.JointGoal(goal)], timeout=TIMEOUT, constraints=constraints)
    path = planner.plan(asked, scene).path
    looks = path.positions(dense_times(path))
    assert [words for state in looks for words in broken(model, constraints, state)] == []
    assert deepest_overlap(path, scene) > -OVERLAP_TOLERANCE
    assert broken_limits(path, model.limits) == []
    assert np.allclose(path.at(0.0).position, start, atol=1e-9)
    assert np.allclose(path.end.position, goal, atol=1e-6)
    if (name, constraints_of) == ('panda', level):  # the first path counts, however many attempts
        again = ap.Planner(model, seed=seed).plan(replace(asked, attempts=5), scene).path
        assert again.duration == path.duration


def test_a_pose_is_reached_by_a_solution_that_heeds_the_constraints() -> None:
    """Of the solutions of inverse kinematics those that do not are no goals."""
    model = robot('gp110')
    start = ready('gp110')
    pose = model.pose(start)
    aside = ap.PoseGoal(am.Pose(pose.rotation, am.frozen(np.add(pose.position, [0.0, 0.3, 0.1]))))
    asked = ap.MotionRequest(start, [aside], timeout=TIMEOUT, constraints=level(model))
    path = ap.Planner(model).plan(asked).path
    assert ConstraintCheck(model, level(model)).path(path) is None
    assert model.pose(path.end.position).position == pytest.approx(aside.pose.position, abs=1e-5)


@pytest.mark.parametrize('by_pose', [False, True])
def test_a_goal_that_breaks_a_constraint_is_reached_where_its_tolerance_heeds_it(
    *, by_pose: bool
) -> None:
    """A part of the tolerance is enough; without one the goal is refused."""
    model, start = robot('gp110'), ready('gp110')
    least = float(start[0]) - 0.3
    constraints = ap.PathConstraints({model.joints[0]: (least, least + 2.0)})
    places = am.frozen(start - 0.4 * np.eye(6)[0])
    goal: ap.JointGoal | ap.PoseGoal = ap.JointGoal(places, am.frozen([0.3] * 6))
    exact: ap.JointGoal | ap.PoseGoal = ap.JointGoal(places)
    if by_pose:
        exact = ap.PoseGoal(model.pose(places))
        goal = replace(exact, tolerances=near(exact.pose, am.Sphere(1.0), am.frozen([0.5] * 3)))
    asked = ap.MotionRequest(start, [goal], timeout=TIMEOUT, constraints=constraints)
    path = ap.Planner(model).plan(asked).path
    assert path.positions(dense_times(path))[:, 0].min() >= least - 1e-9
    if isinstance(goal, ap.PoseGoal) and goal.tolerances is not None:
        assert broken(model, goal.tolerances, path.end.position) == []
    else:
        assert np.abs(path.end.position - places).max() <= 0.3 + 1e-6
    with pytest.raises(ap.PlanningError, match='goal: ') as refused:
        ap.Planner(model).plan(replace(asked, goals=[exact]))
    assert refused.value.code is ap.PlanningCode.GOAL_VIOLATES_PATH_CONSTRAINTS


def test_a_tilted_goal_is_reached_upright_where_its_tolerance_is_wide() -> None:
    """What is narrow in a wide tolerance is found by projection, not by chance."""
    model, start = robot('panda'), ready('panda')
    (turn,) = level(model).orientations
    narrow = replace(turn, tolerance=am.frozen([0.02, 0.02, FREE_TURN]))
    constraints = ap.PathConstraints(orientations=[narrow])
    pose = model.pose(start)
    tilted = pose.rotation @ pin.exp3(np.array([0.2, 0.0, 0.0]))
    aside = am.Pose(am.frozen(tilted), am.frozen(np.add(pose.position, [0.0, 0.2, 0.0])))
    tolerances = near(aside, am.Sphere(0.01), am.frozen([0.4] * 3))
    goal = ap.PoseGoal(aside, tolerances=tolerances)
    asked = ap.MotionRequest(start, [goal], timeout=TIMEOUT, constraints=constraints)
    path = ap.Planner(model).plan(asked).path
    looks = path.positions(dense_times(path))
    assert [words for state in looks for words in broken(model, constraints, state)] == []
    assert broken(model, tolerances, path.end.position) == []


def test_what_cannot_be_is_refused() -> None:
    """With the joint, and what to do; too narrow for free motion is not too narrow for LIN."""
    model, start = robot('panda'), ready('panda')
    pose = model.pose(start)
    below = ap.PoseGoal(am.Pose(pose.rotation, am.frozen(np.add(pose.position, [0.0, 0.0, -0.1]))))
    turn = ap.OrientationConstraint(model.tip, pose.rotation, am.frozen([1e-3] * 3))
    narrow = ap.PathConstraints(orientations=[turn])
    aside = ap.JointGoal(am.frozen(start + 0.5 * np.eye(7)[0]))
    for goal, constraints, words in (
        (aside, ap.PathConstraints({'panda_joint2': (-0.785, -0.784)}), '0.0010 wide'),
        (aside, ap.PathConstraints({'panda_joint2': (0.5, -0.5)}), 'contradict'),
        (below, narrow, '0.0020 wide'),
    ):
        with pytest.raises(ap.PlanningError, match=words) as refused:
            ap.Planner(model).plan(ap.MotionRequest(start, [goal], constraints=constraints))
        assert refused.value.code is ap.PlanningCode.PLANNING_FAILED
    line = ap.MotionRequest(start, [below], 'LIN', constraints=narrow)
    assert ap.Planner(model).plan(line).path.duration > 0.0
