# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motions with path constraints: they hold everywhere, or there is no motion, and why."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
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

from arm_model import Array, Box, Cylinder, frozen, ORIGIN, PlacedShape, Pose, RobotModel, Sphere
from arm_planning import (
    JointGoal,
    MotionRequest,
    OrientationConstraint,
    PathConstraints,
    Planner,
    PlanningCode,
    PlanningError,
    PoseGoal,
    PositionConstraint,
)
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


def level(model: RobotModel) -> PathConstraints:
    """Keep a cup level: turned about its axis only, which is that of the tool at ready."""
    upright = model.pose(ready(model.name)).rotation
    turn = OrientationConstraint(model.tip, upright, frozen([0.1, 0.1, FREE_TURN]))
    return PathConstraints(orientations=[turn])


def level_from_behind(model: RobotModel) -> PathConstraints:
    """Keep a cup level that begins nearly half a turn about its axis away."""
    (turn,) = level(model).orientations
    wanted = frozen(turn.rotation @ pin.exp3(np.array([0.0, 0.0, 2.9])))
    return PathConstraints(orientations=[replace(turn, rotation=wanted)])


def in_a_slab(model: RobotModel) -> PathConstraints:
    """Keep a point before the tip at a height: in a flat box, or in a cylinder beside it."""
    pose = model.pose(ready(model.name))
    offset = frozen([0.0, 0.0, 0.05])
    place = Pose(ORIGIN.rotation, frozen(pose.position + pose.rotation @ offset))
    low = Pose(ORIGIN.rotation, frozen(place.position - [0.0, 0.0, 5.0]))
    regions = [PlacedShape(Box(4.0, 4.0, 0.08), place), PlacedShape(Cylinder(0.1, 0.1), low)]
    return PathConstraints(positions=[PositionConstraint(model.tip, offset, regions)])


def by_joints(model: RobotModel) -> PathConstraints:
    """Keep two joints near ready, and the cup level besides."""
    at = dict(zip(model.joints, ready(model.name).tolist(), strict=True))
    first, second = model.joints[:2]
    joints = {name: (at[name] - 0.4, at[name] + 0.3) for name in (first, second)}
    return replace(level(model), joints=joints)


def broken(model: RobotModel, constraints: PathConstraints, state: Array) -> list[str]:
    """Return which constraints of the tip a state breaks, by their definitions."""
    found = []
    pose = model.pose(state)
    at = dict(zip(model.joints, state.tolist(), strict=True))
    for name, (lower, upper) in constraints.joints.items():
        if not lower - EDGE <= at[name] <= upper + EDGE:
            found.append(f'{name} at {at[name]}')
    for turn in constraints.orientations:
        turned = pin.AngleAxis(turn.rotation.T @ pose.rotation)
        off = turned.angle * turned.axis
        if (np.abs(off) > turn.tolerance + EDGE).any():
            found.append(f'turned by {off}')
    for place in constraints.positions:
        point = pose.position + pose.rotation @ place.offset
        if not any(_in_region(region, point) for region in place.regions):
            found.append(f'{point} is in no region')
    return found


def _in_region(region: PlacedShape, point: Array) -> bool:
    if not isinstance(region.shape, (Box, Cylinder)):
        raise TypeError(region.shape)
    return holds(region.shape, region.pose.rotation.T @ (point - region.pose.position), EDGE)


def ends(
    model: RobotModel, check: ConstraintCheck, planner: Planner, seed: int
) -> tuple[Array, Array]:
    """Return two states far apart that are valid and heed constraints."""
    draw, found = np.random.default_rng(seed), list[Array]()
    scene = with_random_boxes(model, 5, seed)
    while len(found) < 2:
        drawn = ready(model.name) + draw.uniform(-AROUND, AROUND, len(model))
        state = check.projected(np.clip(drawn, model.limits.lower, model.limits.upper))
        if state is None or planner.is_valid(state, scene) is not None:
            continue
        if not found or np.linalg.norm(state - found[0]) > APART:
            found.append(frozen(state))
    return found[0], found[1]


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize('constraints_of', [level, level_from_behind, in_a_slab, by_joints])
@pytest.mark.parametrize('seed', SEEDS)
def test_path_constraints_hold_everywhere(
    name: str, constraints_of: Callable[[RobotModel], PathConstraints], seed: int
) -> None:
    """In random scenes, looked at every milliradian; limits and distances hold as ever."""
    model = robot(name)
    scene, constraints = with_random_boxes(model, 5, seed), constraints_of(model)
    check, planner = ConstraintCheck(model, constraints), Planner(model, seed=seed)
    start, goal = ends(model, check, planner, seed)
    asked = MotionRequest(start, [JointGoal(goal)], timeout=TIMEOUT, constraints=constraints)
    path = planner.plan(asked, scene).path
    looks = path.positions(dense_times(path))
    assert [words for state in looks for words in broken(model, constraints, state)] == []
    assert deepest_overlap(path, scene) > -OVERLAP_TOLERANCE
    assert broken_limits(path, model.limits) == []
    assert np.allclose(path.at(0.0).position, start, atol=1e-9)
    assert np.allclose(path.end.position, goal, atol=1e-6)


def test_it_is_the_constraint_that_keeps_the_cup_level() -> None:
    """Without it the same motion tilts the tool by more than is allowed."""
    model = robot('panda')
    constraints = level(model)
    check, planner = ConstraintCheck(model, constraints), Planner(model)
    start, goal = ends(model, check, planner, seed=1)
    path = planner.plan(MotionRequest(start, [JointGoal(goal)], timeout=TIMEOUT)).path
    assert check.path(path) is not None


def test_under_constraints_the_first_path_counts() -> None:
    """Further attempts would take as long each, until the time is over."""
    model = robot('panda')
    constraints = level(model)
    start, goal = ends(model, ConstraintCheck(model, constraints), Planner(model), seed=0)
    asked = MotionRequest(start, [JointGoal(goal)], timeout=TIMEOUT, constraints=constraints)
    scene = with_random_boxes(model, 5, 0)
    first, second = (
        Planner(model).plan(replace(asked, attempts=count), scene).path.duration
        for count in (1, 5)
    )
    assert first == second


def test_a_pose_is_reached_by_a_solution_that_heeds_the_constraints() -> None:
    """Of the solutions of inverse kinematics those that do not are no goals."""
    model = robot('gp110')
    start = ready('gp110')
    pose = model.pose(start)
    aside = PoseGoal(Pose(pose.rotation, frozen(np.add(pose.position, [0.0, 0.3, 0.1]))))
    asked = MotionRequest(start, [aside], timeout=TIMEOUT, constraints=level(model))
    path = Planner(model).plan(asked).path
    assert ConstraintCheck(model, level(model)).path(path) is None
    assert model.pose(path.end.position).position == pytest.approx(aside.pose.position, abs=1e-5)


@pytest.mark.parametrize('by_pose', [False, True])
def test_a_goal_that_breaks_a_constraint_is_reached_where_its_tolerance_heeds_it(
    *, by_pose: bool
) -> None:
    """A part of the tolerance is enough; without one the goal is refused."""
    model, start = robot('gp110'), ready('gp110')
    least = float(start[0]) - 0.3
    constraints = PathConstraints({model.joints[0]: (least, least + 2.0)})
    places = start.copy()
    places[0] -= 0.4
    goal: JointGoal | PoseGoal = JointGoal(frozen(places), frozen([0.3] * 6))
    exact: JointGoal | PoseGoal = JointGoal(frozen(places))
    if by_pose:
        exact = PoseGoal(model.pose(frozen(places)))
        goal = replace(exact, tolerances=near(exact.pose, Sphere(1.0), frozen([0.5] * 3)))
    asked = MotionRequest(start, [goal], timeout=TIMEOUT, constraints=constraints)
    path = Planner(model).plan(asked).path
    end = path.end.position
    assert path.positions(dense_times(path))[:, 0].min() >= least - 1e-9
    if by_pose:
        at = model.pose(end)
        wanted = model.pose(frozen(places))
        assert np.linalg.norm(at.position - wanted.position) <= 1.0 + 1e-6
        turned = pin.log3(wanted.rotation.T @ at.rotation)
        assert np.abs(turned).max() <= 0.5 + 1e-6
    else:
        assert np.abs(end - places).max() <= 0.3 + 1e-6
    with pytest.raises(PlanningError, match='goal: ') as refused:
        Planner(model).plan(replace(asked, goals=[exact]))
    assert refused.value.code is PlanningCode.GOAL_VIOLATES_PATH_CONSTRAINTS


def test_a_tilted_goal_is_reached_upright_where_its_tolerance_is_wide() -> None:
    """What is narrow in a wide tolerance is found by projection, not by chance."""
    model, start = robot('panda'), ready('panda')
    (turn,) = level(model).orientations
    constraints = PathConstraints(
        orientations=[replace(turn, tolerance=frozen([0.02, 0.02, FREE_TURN]))]
    )
    pose = model.pose(start)
    tilted = pose.rotation @ pin.exp3(np.array([0.2, 0.0, 0.0]))
    aside = Pose(frozen(tilted), frozen(np.add(pose.position, [0.0, 0.2, 0.0])))
    goal = PoseGoal(aside, tolerances=near(aside, Sphere(0.01), frozen([0.4] * 3)))
    asked = MotionRequest(start, [goal], timeout=TIMEOUT, constraints=constraints)
    path = Planner(model).plan(asked).path
    looks = path.positions(dense_times(path))
    assert [words for state in looks for words in broken(model, constraints, state)] == []
    at = model.pose(path.end.position)
    assert np.linalg.norm(at.position - aside.position) <= 0.01 + 1e-6
    assert np.abs(pin.log3(tilted.T @ at.rotation)).max() <= 0.4 + 1e-6


def refusal(asked: MotionRequest) -> PlanningError:
    """Return why a motion of the Panda is refused."""
    with pytest.raises(PlanningError) as caught:
        Planner(robot('panda')).plan(asked)
    return caught.value


@pytest.mark.parametrize(
    ('bounds', 'words'), [((-0.785, -0.784), '0.0010 wide'), ((0.5, -0.5), 'contradict')]
)
def test_what_cannot_be_is_refused(bounds: tuple[float, float], words: str) -> None:
    """With the joint, and what to do."""
    start = ready('panda')
    goal = JointGoal(frozen(start + 0.5 * np.eye(7)[0]))
    constraints = PathConstraints({'panda_joint2': bounds})
    error = refusal(MotionRequest(start, [goal], constraints=constraints))
    assert error.code is PlanningCode.PLANNING_FAILED
    assert words in str(error)


def test_a_line_holds_a_turn_exactly() -> None:
    """A constraint that is too narrow for free motion is none for LIN."""
    model = robot('panda')
    pose = model.pose(ready('panda'))
    below = PoseGoal(Pose(pose.rotation, frozen(np.add(pose.position, [0.0, 0.0, -0.1]))))
    turn = OrientationConstraint(model.tip, pose.rotation, frozen([1e-3] * 3))
    narrow = PathConstraints(orientations=[turn])
    line = MotionRequest(ready('panda'), [below], 'LIN', constraints=narrow)
    assert Planner(model).plan(line).path.duration > 0.0
    assert '0.0020 wide' in str(refusal(replace(line, planner_id='RRTConnect')))
