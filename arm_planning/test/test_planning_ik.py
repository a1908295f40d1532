# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Inverse kinematics: what it finds, in which order, and why it finds nothing."""

from __future__ import annotations

from functools import cache, partial
from itertools import count

from hypothesis import given, settings
from hypothesis import strategies as st
from model_robots import chain, ready, robot, ROBOTS, STRAIGHT, table, texts
import numpy as np
from planning_scenes import distances
import pytest

import arm_model as am
from arm_planning import PlanningCode, PlanningError
from arm_planning.ik import IkSolver
from arm_planning.link_kinematics import pose_error

pytestmark = pytest.mark.slow

SPHERICAL = ('prbt', 'gp110')

seeds = st.integers(0, 10**6)


@cache
def solver(name: str) -> IkSolver:
    """Return the solver of a robot's tip."""
    return IkSolver(robot(name))


def drawn(limits: am.JointLimits, seed: int) -> am.Array:
    """Return random positions within limits."""
    return np.random.default_rng(seed).uniform(*limits.span(np.zeros(len(limits))))


def meets(inverse: IkSolver, pose: am.Pose, positions: am.Array, tolerance: float) -> bool:
    """Whether forward kinematics lead to a pose."""
    error = pose_error(pose, inverse.link.pose(positions))
    return bool(np.abs(error).max() <= tolerance)


@pytest.mark.parametrize('name', SPHERICAL)
@settings(max_examples=100, deadline=None)
@given(seed=seeds)
def test_closed_form_finds_every_solution(name: str, seed: int) -> None:
    """All meet the pose within the limits, and the one that made the pose is the first.

    Each, as the seed, finds itself first and the same number of solutions.
    """
    inverse, limits = solver(name), robot(name).limits
    positions = drawn(limits, seed)
    pose = inverse.link.pose(positions)
    found = inverse.solve(pose, positions)
    assert found[0] == pytest.approx(positions, abs=1e-6)
    assert len(found) <= 8
    away = [float(np.linalg.norm(each - positions)) for each in found]
    assert away == sorted(away)
    for each in found:
        assert meets(inverse, pose, each, 1e-9)
        assert (each >= limits.lower).all()
        assert (each <= limits.upper).all()
        again = inverse.solve(pose, each)
        assert again[0] == pytest.approx(each, abs=1e-6)
        assert len(again) == len(found)


@pytest.mark.parametrize('name', SPHERICAL)
@settings(max_examples=50, deadline=None)
@given(seed=seeds, joints=st.sets(st.integers(0, 5)))
def test_singular_poses_keep_the_seed(name: str, seed: int, joints: set[int]) -> None:
    """With joints at zero (straight elbow, straight wrist, both) the seed is a solution still."""
    inverse = solver(name)
    positions = drawn(robot(name).limits, seed)
    positions[list(joints)] = STRAIGHT[name][list(joints)]
    pose = inverse.link.pose(positions)
    found = inverse.solve(pose, positions)
    assert all(meets(inverse, pose, each, 1e-9) for each in found)
    assert np.abs(found[0] - positions).max() < 1e-5


def test_only_arms_with_a_spherical_wrist_have_a_closed_form() -> None:
    """Others, with seven joints, sliding ones or axes that do not meet, have none.

    It places any link that the last joint moves; links before it are searched for.
    """
    assert solver('panda').closed_form is None
    for kinds in ('zyyzyz', 'pyyxyx', 'zyy', 'zyyzyzc'):
        assert IkSolver(chain(kinds)).closed_form is None
    model, here = robot('gp110'), ready('gp110')
    joint_of = {each: model.kinematics.parent_joint(each) for each in model.frames}
    behind = [each for each, joint in joint_of.items() if joint == 6]
    assert model.tip in behind
    for name in behind:
        inverse = IkSolver(model, name)
        assert inverse.closed_form is not None
        pose = model.kinematics.link_pose(name, here)
        assert inverse.solve(pose, here)[0] == pytest.approx(here, abs=1e-9)
    elbow = next(each for each, joint in joint_of.items() if joint == 3)
    assert IkSolver(model, elbow).closed_form is None


@pytest.mark.parametrize('kinds', ['zyzyzyz', 'czyzyzy', 'pzyyzxz', 'zyyzyc'])
@settings(max_examples=15, deadline=None)
@given(seed=seeds)
def test_numeric_solutions_meet_the_pose(kinds: str, seed: int) -> None:
    """Of redundant, continuous and sliding joints: within limits, next to the seed."""
    model = chain(kinds)
    inverse = IkSolver(model)
    positions = drawn(model.limits, seed)
    start = drawn(model.limits, seed + 1)
    pose = inverse.link.pose(positions)
    found = inverse.solve(pose, start, timeout=5.0)
    for each in found:
        assert meets(inverse, pose, each, 1e-6)
        assert (each >= model.limits.lower).all()
        assert (each <= model.limits.upper).all()
        turned = np.abs(each - start)[model.limits.continuous]
        assert (turned <= np.pi + 1e-9).all()


def test_several_solutions_of_a_redundant_arm() -> None:
    """As many different ones as asked for, nearest first."""
    pose, seed = solver('panda').link.pose(ready('panda')), ready('panda')
    found = solver('panda').solve(pose, seed, timeout=10.0, count=4)
    assert len(found) == 4
    away = [float(np.linalg.norm(each - seed)) for each in found]
    assert away == sorted(away)
    assert len({tuple(np.round(each, 2)) for each in found}) == 4


@pytest.mark.parametrize('name', ROBOTS)
def test_why_nothing_is_found_is_said(name: str) -> None:
    """How far it is out of reach; a joint beyond its limits; what touches in every solution."""
    inverse, here, limits = solver(name), ready(name), table(name)
    pose = inverse.link.pose(here)
    far = am.Pose(pose.rotation, pose.position + np.array([9.0, 0.0, 0.0]))
    ball = robot(name).scene.with_object(am.CollisionObject('ball', am.Sphere(0.2), pose=pose))
    for joint, position in zip(robot(name).joints, here.tolist(), strict=True):
        narrow = {'min_position': position - 0.05, 'max_position': position + 0.05}
        limits[joint] = {**limits[joint], 'has_position_limits': True, **narrow}
    moved = here.copy()
    moved[:2] += 0.3
    narrowed = am.RobotModel(*texts(name), limits)
    joints = '|'.join(narrowed.joints)
    for words, solve in (
        (r'out of reach by [5-9]\.\d{3} m', partial(inverse.solve, far, here)),
        (r'ball overlap by \d+', partial(inverse.solve, pose, here, ball)),
        (
            rf'beyond the limits.*({joints}) at',
            partial(IkSolver(narrowed).solve, inverse.link.pose(moved), here),
        ),
    ):
        with pytest.raises(PlanningError, match=words) as refused:
            solve()
        assert refused.value.code is PlanningCode.NO_IK_SOLUTION


@pytest.mark.parametrize('name', SPHERICAL)
@settings(max_examples=30, deadline=None)
@given(seed=seeds)
def test_solutions_in_contact_are_left_out(name: str, seed: int) -> None:
    """With a floor, those that are free of contact are left, in the same order."""
    inverse, model = solver(name), robot(name)
    positions = drawn(model.limits, seed)
    pose = inverse.link.pose(positions)
    floor = model.scene.with_object(am.CollisionObject('floor', am.Plane(offset=-0.3)))
    every = inverse.solve(pose, positions)
    free = [each for each in every if distances(floor, each).min() >= 0.0]
    if free:
        assert np.array_equal(inverse.solve(pose, positions, floor), free)
    else:
        with pytest.raises(PlanningError, match='in contact'):
            inverse.solve(pose, positions, floor)


def test_time_out_is_that_of_the_clock() -> None:
    """No start is begun after it; one is made however short it is."""
    ticks = count(0.0, 1.0)
    inverse = IkSolver(robot('panda'), clock=lambda: next(ticks))
    pose = inverse.link.pose(ready('panda'))
    far = am.Pose(pose.rotation, pose.position + np.array([3.0, 0.0, 0.0]))
    with pytest.raises(PlanningError, match='in 3 starts'):
        inverse.solve(far, ready('panda'), timeout=2.5)
    assert inverse.solve(pose, ready('panda'), timeout=0.0)


def test_what_is_no_pose_is_refused() -> None:
    """A NaN, a mirrored rotation, too few joints, an unknown link."""
    inverse, here = solver('prbt'), ready('prbt')
    pose = inverse.link.pose(here)
    for words, wanted, seed in (
        ('finite', am.Pose(pose.rotation, am.frozen([0.0, np.nan, 0.0])), here),
        ('mirror', am.Pose(-np.eye(3), pose.position), here),
        ('seed', pose, here[:1]),
    ):
        with pytest.raises(PlanningError, match=words):
            inverse.solve(wanted, seed)
    with pytest.raises(PlanningError, match='choose one of') as refused:
        IkSolver(robot('prbt'), 'hand')
    assert refused.value.code is PlanningCode.INVALID_LINK_NAME
    with pytest.raises(PlanningError, match='no joint of group'):
        IkSolver(robot('prbt'), robot('prbt').base)
