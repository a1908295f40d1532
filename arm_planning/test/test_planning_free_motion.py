# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Free motions are valid everywhere, and what cannot be planned is refused with the reason."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import count
import os
import time
from typing import Any

from model_robots import ready, robot, ROBOTS
import numpy as np
from planning_scenes import broken_limits, deepest_overlap, near, with_box, with_random_boxes
import pytest

from arm_model import Array, Box, frozen, ORIGIN, PlanningScene, Pose, RobotModel, Sphere
from arm_planning import (
    JointGoal,
    MotionRequest,
    Planner,
    PlanningCode,
    PlanningError,
    PoseGoal,
    ValidityCheck,
)
from arm_planning.free_motion import FreeMotion
from arm_trajectory import Path

pytestmark = pytest.mark.slow

SEEDS = range(int(os.environ.get('PLANNING_SEEDS', '2')))
"""Of the random scenes; more of them by the environment."""

SPEED = 0.1  # greatest speed of a link in [m/s]
OVERLAP_TOLERANCE = 1e-6  # overlap that counts as rounding in [m]
TIMEOUT = 60.0  # time for planning in [s]: a busy machine is no failure

AROUND = 0.9  # how far a goal may be from the ready pose in [rad]


def request(start: Array, goal: Array) -> MotionRequest:
    """Return a motion between two states."""
    return MotionRequest(start, [JointGoal(goal)], timeout=TIMEOUT)


def refusal(planner: Planner, asked: MotionRequest) -> PlanningError:
    """Return why a motion is refused."""
    with pytest.raises(PlanningError) as caught:
        planner.plan(asked)
    return caught.value


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize('seed', SEEDS)
def test_a_plan_never_touches_and_never_breaks_a_limit(name: str, seed: int) -> None:
    """In random scenes, looked at every milliradian, at half the speed of the drives, too."""
    model = robot(name)
    scene = with_random_boxes(model, 8, seed)
    planner, draw = Planner(model, seed=seed), np.random.default_rng(seed)
    lower = np.maximum(model.limits.lower, ready(name) - AROUND)
    upper = np.minimum(model.limits.upper, ready(name) + AROUND)
    states = (frozen(draw.uniform(lower, upper)) for _ in range(2000))
    free = (each for each in states if planner.is_valid(each, scene) is None)
    start, goal = next(free), next(free)
    share = 1.0 if seed % 2 else 0.5
    asked = replace(request(start, goal), velocity_scaling=share, acceleration_scaling=share)
    plan = planner.plan(asked, scene)
    assert deepest_overlap(plan.path, scene) > -OVERLAP_TOLERANCE
    limits = replace(
        model.limits,
        velocity=share * model.limits.velocity,
        acceleration=share * model.limits.acceleration,
        jerk=share * model.limits.jerk,
    )
    assert broken_limits(plan.path, limits) == []
    assert np.allclose(plan.path.at(0.0).position, start, atol=1e-9)
    assert np.allclose(plan.path.end.position, goal, atol=1e-6)
    for end in (plan.path.at(0.0), plan.path.end):  # from rest to rest, so that motions follow
        assert np.allclose((end.velocity, end.acceleration), 0.0, atol=1e-6)


def turned(angle: float) -> Array:
    """Return the ready pose of the Panda with its first joint turned."""
    return frozen(ready('panda') + angle * np.eye(7)[0])


def at_a_pillar() -> tuple[RobotModel, PlanningScene, Array, Array]:
    """Return the Panda, a scene with a pillar before it, and a state on either side of that."""
    model = robot('panda')
    scene = with_box(model.scene, 'pillar', (0.1, 0.1, 1.5), (0.4, 0.0, 0.75))
    return model, scene, turned(-0.8), turned(0.8)


def around_a_pillar(
    seed: int, expired: Callable[[], bool] = lambda: False, *, far: float | None = None
) -> Path:
    """Plan from one side of a pillar to the other, or to the same with a turned hand."""
    model, scene, start, goal = at_a_pillar()
    goals = [goal] if far is None else [goal, frozen(goal - far * np.eye(7)[6])]
    check = ValidityCheck(model.limits, scene)
    return FreeMotion(model.limits, check, np.random.default_rng(seed)).plan(start, goals, expired)


def test_goals_that_are_found_meanwhile_count() -> None:
    """The first one is behind a wall; the next come while the search runs."""
    model = robot('panda')
    scene = with_box(model.scene, 'left', (1.1, 0.02, 1.0), (0.69, 0.0, 0.5))
    scene = with_box(scene, 'right', (1.1, 0.02, 1.0), (-0.7, 0.0, 0.5))
    scene = with_box(scene, 'roof', (2.5, 2.5, 0.02), (0.0, 0.0, 0.8))
    free = FreeMotion(model.limits, ValidityCheck(model.limits, scene), np.random.default_rng(0))
    deadline = time.monotonic() + TIMEOUT
    later = iter([None, turned(1.9)])
    path = free.plan(turned(1.2), [turned(-1.2)], lambda: time.monotonic() > deadline, later)
    assert path.end.position == pytest.approx(turned(1.9))


def length(path: Path) -> float:
    """Return the length of a path in [rad]."""
    places = path.positions(np.linspace(0.0, path.duration, 500))
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


@pytest.mark.parametrize(('far', 'most'), [(None, 1.3), (2.0, 1.45)])
def test_most_plans_take_the_shorter_side(far: float | None, most: float) -> None:
    """A search that went around the pillar on the longer side is not kept without another one.

    Of two goals behind the pillar, the one that is far away is not the end of the search.
    """
    lengths = [length(around_a_pillar(seed, far=far)) for seed in range(20)]
    assert np.percentile(lengths, 80) < most * min(lengths)


@pytest.mark.parametrize('seed', range(4))
def test_more_time_never_loses_a_plan(seed: int) -> None:
    """A search that runs out of time leaves what was found before."""

    def found(looks: int) -> bool:
        left = iter(range(looks))
        with suppress(PlanningError):
            around_a_pillar(seed, lambda: next(left, None) is None)
            return True
        return False

    asked = count()
    around_a_pillar(seed, lambda: next(asked) < 0)
    all_of_it = next(asked)
    results = [found(looks) for looks in range(0, all_of_it + 1, max(all_of_it // 25, 1))]
    assert not results[0]
    assert results == sorted(results)


def test_the_alternative_that_is_free_is_reached() -> None:
    """One blocked goal of two is no refusal; the same seed gives the same plan."""
    model, scene, start, goal = at_a_pillar()
    scene = with_box(scene, 'crate', (0.1, 0.1, 0.1), tuple(model.pose(goal).position.tolist()))
    asked = MotionRequest(start, [JointGoal(goal), JointGoal(turned(1.7))], timeout=TIMEOUT)
    one, other = (Planner(model, seed=5).plan(asked, scene).path for _ in range(2))
    assert np.allclose(one.end.position, turned(1.7), atol=1e-6)
    assert np.array_equal(one.coefficients, other.coefficients)


def test_what_is_enclosed_is_given_up_in_time() -> None:
    """The time is over: says so, and does not hang. The clock is that of the test."""
    model, ticks = robot('panda'), count()
    planner = Planner(model, clock=lambda: 0.001 * next(ticks))
    start, goal = ready('panda').copy(), ready('panda').copy()
    start[[0, 1, 3]], goal[[0, 1, 3]] = (-2.0, 0.5, -1.0), (2.0, 0.5, -1.0)  # on either side
    scene = model.scene
    for x in (1.1, -1.1):  # a wall from the ground to beyond the reach
        scene = with_box(scene, f'wall {x}', (1.9, 0.02, 4.0), (x, 0.0, 1.0))
    scene = with_box(scene, 'lintel', (1.0, 0.02, 2.0), (0.0, 0.0, 1.55))
    with pytest.raises(PlanningError, match='no path was found in time') as caught:
        planner.plan(replace(request(start, goal), timeout=0.1), scene)
    assert caught.value.code is PlanningCode.TIMED_OUT


@pytest.mark.parametrize('planner_id', ['', 'PTP', 'LIN'])
def test_requests_that_make_no_sense_are_refused(planner_id: str) -> None:
    """Each with what is wrong and what would be right, whichever planner is asked."""
    planner, here = Planner(robot('panda')), ready('panda')
    asked = replace(request(here, here + 0.1), planner_id=planner_id)
    nan, beyond = frozen([np.nan, *here[1:]]), here.copy()
    beyond[1] = 3.0
    turn = PoseGoal(Pose(2.0 * ORIGIN.rotation, frozen([0.5, 0.0, 0.5])))
    cases: list[tuple[str, dict[str, Any]]] = [
        ("unknown planner_id 'STOMP'; choose one of", {'planner_id': 'STOMP'}),
        ('the request has no goal', {'goals': []}),
        ('velocity_scaling is 1.5; it must be', {'velocity_scaling': 1.5}),
        ('acceleration_scaling is 0.0; it must be', {'acceleration_scaling': 0.0}),
        ('start: 6 numbers, 7 are needed', {'start': here[:6]}),
        ('start: number 0 is nan', {'start': nan}),
        ('start: panda_joint2 at', {'start': beyond}),
        ('goal: number 0 is nan', {'goals': [JointGoal(nan)]}),
        ('goal: panda_joint2 at', {'goals': [JointGoal(beyond)]}),
        ('rotation of the pose', {'goals': [turn]}),
        ('max_cartesian_speed is nan', {'max_cartesian_speed': np.nan}),
        ('max_cartesian_speed is -1', {'max_cartesian_speed': -1.0}),
        ("no link 'moon'", {'max_cartesian_speed': 1.0, 'cartesian_speed_link': 'moon'}),
    ]
    for words, fields in cases:
        assert words in str(refusal(planner, replace(asked, **fields)))
    if planner_id != 'LIN':  # a link without a speed limit has no effect
        assert planner.plan(replace(asked, cartesian_speed_link='moon')).path.duration


def test_a_cancel_ends_the_search_for_goals() -> None:
    """Most of those that are out of reach are not tried."""
    planner, looks = Planner(robot('panda')), count()
    far = [Pose(ORIGIN.rotation, frozen([3.0 + 0.1 * each, 0.0, 0.5])) for each in range(20)]
    asked = MotionRequest(ready('panda'), list(map(PoseGoal, far)), timeout=TIMEOUT)
    with pytest.raises(PlanningError) as caught:
        planner.plan(asked, is_canceled=lambda: next(looks) > 2)
    assert caught.value.code is PlanningCode.PREEMPTED


@pytest.mark.parametrize(
    ('planner_id', 'link'), [('', ''), ('', 'panda_link4'), ('PTP', 'panda_link4'), ('LIN', '')]
)
def test_the_speed_of_a_link_is_limited(planner_id: str, link: str) -> None:
    """max_cartesian_speed holds on a motion, whose places it leaves as they are."""
    model, start = robot('panda'), ready('panda')
    way = np.array([0.8, 0.4, 0.0, -0.4, 0.0, 0.5, 0.0])
    asked = replace(request(start, frozen(start + way)), planner_id=planner_id)
    if planner_id == 'LIN':
        pose = model.pose(start)
        away = Pose(pose.rotation, frozen(np.add(pose.position, [0.0, 0.2, 0.0])))
        asked = replace(asked, goals=[PoseGoal(away)])
    quick = Planner(model, seed=1).plan(asked).path
    asked = replace(asked, max_cartesian_speed=SPEED, cartesian_speed_link=link)
    plan = Planner(model, seed=1).plan(asked)
    times = np.linspace(0.0, plan.path.duration, 3000)
    rows = plan.path.positions(times)
    places = [model.kinematics.link_pose(link or model.tip, row).position for row in rows]
    speed = np.linalg.norm(np.diff(places, axis=0), axis=1).max() / times[1]
    assert 0.99 * SPEED < speed <= SPEED
    assert any('0.1 m/s' in note for note in plan.notes)
    share = quick.duration / plan.path.duration
    assert rows == pytest.approx(quick.positions(times * share), abs=1e-9)


def test_a_joint_goal_in_contact_is_reached_within_its_tolerance() -> None:
    """As MoveIt samples it; without a tolerance it is refused."""
    model = robot('gp110')
    goal = ready('gp110').copy()
    goal[0] += 0.8
    scene = with_box(model.scene, 'post', (0.1,) * 3, tuple(model.pose(goal).position.tolist()))
    tolerance = frozen([0.5, 0.1, 0.1, 0.1, 0.1, 0.1])
    asked = MotionRequest(ready('gp110'), [JointGoal(frozen(goal), tolerance)], timeout=TIMEOUT)
    path = Planner(model).plan(asked, scene).path
    assert (np.abs(path.end.position - goal) <= tolerance + 1e-6).all()
    assert deepest_overlap(path, scene) > -OVERLAP_TOLERANCE
    with pytest.raises(PlanningError) as caught:
        Planner(model).plan(request(ready('gp110'), frozen(goal)), scene)
    assert caught.value.code is PlanningCode.GOAL_IN_COLLISION


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize('box', [False, True])
def test_a_pose_out_of_reach_is_reached_within_its_tolerance(name: str, *, box: bool) -> None:
    """The middle of the region is beyond the arm, a part of it is not."""
    model = robot(name)
    pose = model.pose(ready(name))
    away = pose.position / np.linalg.norm(pose.position)
    far = Pose(pose.rotation, frozen(away * (1.3 * model.reach + 0.05)))
    size = 0.6 * model.reach
    shape = Box(*[2.0 * size] * 3) if box else Sphere(size)
    goal = PoseGoal(far, tolerances=near(far, shape, frozen([1.0, 1.0, 3.2])))
    path = Planner(model).plan(MotionRequest(ready(name), [goal], timeout=TIMEOUT)).path
    off = model.pose(path.end.position).position - far.position
    assert (np.abs(off).max() if box else np.linalg.norm(off)) <= size + 1e-6
    exact = MotionRequest(ready(name), [PoseGoal(far)], timeout=TIMEOUT)
    assert refusal(Planner(model), exact).code is PlanningCode.NO_IK_SOLUTION
