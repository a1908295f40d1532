# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Free motions are valid everywhere, and what cannot be planned is refused with the reason."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from itertools import count, pairwise
import os
import time

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

OVERLAP_TOLERANCE = 1e-6  # overlap that counts as rounding in [m]
TIMEOUT = 60.0  # time for planning in [s]: a busy machine is no failure
LENGTH, LINE_TOLERANCE = 0.2, 1e-4  # a straight way of the tip, and how far it may be off, in [m]
NEARBY = 0.12  # how far a motion leads in [m] or [rad]
JUMP = 1e-6  # of a position in [rad] or its derivatives, where one motion follows another
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
    assert np.allclose(plan.path.end.velocity, 0.0, atol=1e-6)


def at_a_pillar() -> tuple[RobotModel, PlanningScene, Array, Array]:
    """Return the Panda, a scene with a pillar before it, and a state on either side of that."""
    model = robot('panda')
    start, goal = (ready('panda') + turn * np.eye(7)[0] for turn in (-0.8, 0.8))
    scene = with_box(model.scene, 'pillar', (0.1, 0.1, 1.5), (0.4, 0.0, 0.75))
    return model, scene, start, goal


def test_an_obstacle_is_gone_around() -> None:
    """The straight motion is blocked, and the plan is longer, but there."""
    model, scene, start, goal = at_a_pillar()
    planner = Planner(model)
    alone = planner.plan(request(start, goal))
    around = planner.plan(request(start, goal), scene)
    assert deepest_overlap(alone.path, scene) < 0.0
    assert deepest_overlap(around.path, scene) > -OVERLAP_TOLERANCE
    assert around.path.duration > alone.path.duration


def around_a_pillar(
    seed: int, expired: Callable[[], bool] = lambda: False, *, turned: float | None = None
) -> Path:
    """Plan from one side of a pillar to the other, or to the same with a turned hand."""
    model, scene, start, goal = at_a_pillar()
    goals = [goal]
    if turned is not None:
        goals.append(goal - turned * np.eye(7)[6])
    check = ValidityCheck(model.limits, scene)
    return FreeMotion(model.limits, check, np.random.default_rng(seed)).plan(start, goals, expired)


def test_goals_that_are_found_meanwhile_count() -> None:
    """The first one is behind a wall; the next come while the search runs."""
    model = robot('panda')
    scene = with_box(model.scene, 'left', (1.1, 0.02, 1.0), (0.69, 0.0, 0.5))
    scene = with_box(scene, 'right', (1.1, 0.02, 1.0), (-0.7, 0.0, 0.5))
    scene = with_box(scene, 'roof', (2.5, 2.5, 0.02), (0.0, 0.0, 0.8))
    start, behind, here = (ready('panda') + turn * np.eye(7)[0] for turn in (1.2, -1.2, 1.9))
    free = FreeMotion(model.limits, ValidityCheck(model.limits, scene), np.random.default_rng(0))
    deadline = time.monotonic() + TIMEOUT
    path = free.plan(
        start, [behind], lambda: time.monotonic() > deadline, iter([None, frozen(here)])
    )
    assert path.end.position == pytest.approx(here)


def length(path: Path) -> float:
    """Return the length of a path in [rad]."""
    places = path.positions(np.linspace(0.0, path.duration, 500))
    return float(np.linalg.norm(np.diff(places, axis=0), axis=1).sum())


def test_most_plans_take_the_shorter_side() -> None:
    """A search that went around the pillar on the longer side is not kept without another one."""
    lengths = [length(around_a_pillar(seed)) for seed in range(20)]
    assert np.percentile(lengths, 80) < 1.3 * min(lengths)


def test_a_far_goal_is_a_detour() -> None:
    """Of two goals behind the pillar, the one that is far away is not the end of the search."""
    lengths = [length(around_a_pillar(seed, turned=2.0)) for seed in range(20)]
    assert np.percentile(lengths, 80) < 1.45 * min(lengths)


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


def test_the_same_seed_gives_the_same_plan() -> None:
    """What went wrong once can be looked at again."""
    model, scene, start, goal = at_a_pillar()
    one, other = (Planner(model, seed=5).plan(request(start, goal), scene) for _ in range(2))
    assert np.array_equal(one.path.coefficients, other.path.coefficients)


def test_the_alternative_that_is_free_is_reached() -> None:
    """One blocked goal of two is no refusal."""
    model = robot('panda')
    blocked, free = ready('panda').copy(), ready('panda').copy()
    blocked[0], free[0] = 0.8, -0.8
    tip = tuple(model.pose(blocked).position.tolist())
    scene = with_box(model.scene, 'crate', (0.1, 0.1, 0.1), tip)
    goals = [JointGoal(blocked), JointGoal(free)]
    plan = Planner(model).plan(MotionRequest(ready('panda'), goals, timeout=TIMEOUT), scene)
    assert np.allclose(plan.path.end.position, free, atol=1e-6)


def test_what_is_enclosed_is_given_up_in_time() -> None:
    """The time is over: says so, and does not hang. The clock is that of the test."""
    model = robot('panda')
    ticks = iter(range(10_000_000))
    planner = Planner(model, clock=lambda: 0.001 * next(ticks))
    start, goal = ready('panda').copy(), ready('panda').copy()
    start[[0, 1, 3]], goal[[0, 1, 3]] = (-2.0, 0.5, -1.0), (2.0, 0.5, -1.0)  # on either side
    scene = model.scene
    for number, angle in enumerate((0.0, np.pi)):  # a wall from the ground to beyond the reach
        at = (1.1 * np.cos(angle), 0.0, 1.0)
        scene = with_box(scene, f'wall_{number}', (1.9, 0.02, 4.0), at)
    scene = with_box(scene, 'lintel', (1.0, 0.02, 2.0), (0.0, 0.0, 1.55))
    asked = replace(request(start, goal), timeout=0.1)
    with pytest.raises(PlanningError, match='no path was found in time') as caught:
        planner.plan(asked, scene)
    assert caught.value.code is PlanningCode.TIMED_OUT


@pytest.mark.parametrize('planner_id', ['', 'PTP', 'LIN'])
def test_requests_that_make_no_sense_are_refused(planner_id: str) -> None:
    """Each with what is wrong and what would be right, whichever planner is asked."""
    planner, here = Planner(robot('panda')), ready('panda')
    asked = replace(request(here, here + 0.1), planner_id=planner_id)
    nan, beyond = frozen([np.nan, *here[1:]]), here.copy()
    beyond[1] = 3.0
    turn = Pose(2.0 * ORIGIN.rotation, frozen([0.5, 0.0, 0.5]))
    cases = {
        "unknown planner_id 'STOMP'; choose one of": replace(asked, planner_id='STOMP'),
        'the request has no goal': replace(asked, goals=[]),
        'velocity_scaling is 1.5; it must be': replace(asked, velocity_scaling=1.5),
        'acceleration_scaling is 0.0; it must be': replace(asked, acceleration_scaling=0.0),
        'start: 6 numbers, 7 are needed': replace(asked, start=here[:6]),
        'start: number 0 is nan': replace(asked, start=nan),
        'start: panda_joint2 at': replace(asked, start=beyond),
        'goal: number 0 is nan': replace(asked, goals=[JointGoal(nan)]),
        'goal: panda_joint2 at': replace(asked, goals=[JointGoal(beyond)]),
        'rotation of the pose': replace(asked, goals=[PoseGoal(turn)]),
    }
    for words, case in cases.items():
        assert words in str(refusal(planner, case))


@pytest.mark.parametrize('name', ROBOTS)
def test_a_pose_is_reached_by_a_free_motion(name: str) -> None:
    """By a solution of inverse kinematics that is free of contact."""
    model, planner = robot(name), Planner(robot(name))
    wanted = ready(name) + 0.3
    goal = PoseGoal(planner.fk(wanted))
    plan = planner.plan(MotionRequest(ready(name), [goal], timeout=TIMEOUT))
    reached = planner.fk(plan.path.end.position)
    assert np.allclose(reached.position, goal.pose.position, atol=1e-5)
    assert np.allclose(reached.rotation, goal.pose.rotation, atol=1e-5)
    assert deepest_overlap(plan.path, model.scene) > -OVERLAP_TOLERANCE


def test_the_planner_id_chooses_the_pipeline() -> None:
    """PTP is straight in joint space, LIN in space; the plan says which planner it was."""
    model, here = robot('panda'), ready('panda')
    planner = Planner(model)
    begin = planner.fk(here)
    goal = PoseGoal(Pose(begin.rotation, begin.position + np.array((0.0, LENGTH, 0.0))))
    for name in ('PTP', 'LIN', 'RRTConnect'):
        plan = planner.plan(MotionRequest(here, [goal], planner_id=name, timeout=TIMEOUT))
        assert plan.planner_id == name
        middle = planner.fk(plan.path.at(0.5 * plan.path.duration).position).position
        off = np.cross(middle - begin.position, (goal.pose.position - begin.position) / LENGTH)
        assert (float(np.linalg.norm(off)) < LINE_TOLERANCE) == (name == 'LIN')


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize('seed', SEEDS)
def test_motions_one_after_the_other_meet_at_rest(name: str, seed: int) -> None:
    """Each begins where the one before it ends, without a jump of position or its derivatives."""
    model, planner = robot(name), Planner(robot(name), seed=seed)
    draw, paths, here = np.random.default_rng(seed), [], ready(name)
    for kind in draw.permutation(['PTP', 'LIN', 'RRTConnect', 'PTP', 'LIN']).tolist():
        pose = planner.fk(here)
        away = frozen(pose.position + draw.uniform(-NEARBY, NEARBY, 3))
        goal: JointGoal | PoseGoal = PoseGoal(Pose(pose.rotation, away))
        if kind != 'LIN':
            goal = JointGoal(frozen(here + draw.uniform(-NEARBY, NEARBY, len(model))))
        asked = MotionRequest(here, [goal], planner_id=kind, timeout=TIMEOUT)
        with suppress(PlanningError):  # out of reach, or in contact
            paths.append(planner.plan(asked).path)
            here = paths[-1].end.position
    assert len(paths) > 1
    for before, after in pairwise(paths):
        ends = (before.end, before.at(before.duration), after.at(0.0))
        for end in ends:
            assert np.abs(end.position - ends[0].position).max() < JUMP
            assert np.abs(end.velocity).max() < JUMP
            assert np.abs(end.acceleration).max() < JUMP


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
    most, model = 0.1, robot('panda')
    start = ready('panda')
    way = np.array([0.8, 0.4, 0.0, -0.4, 0.0, 0.5, 0.0])
    asked = replace(request(start, frozen(start + way)), planner_id=planner_id)
    if planner_id == 'LIN':
        pose = model.pose(start)
        away = Pose(pose.rotation, frozen(np.add(pose.position, [0.0, 0.2, 0.0])))
        asked = replace(asked, goals=[PoseGoal(away)])
    quick = Planner(model, seed=1).plan(asked).path
    plan = Planner(model, seed=1).plan(
        replace(asked, max_cartesian_speed=most, cartesian_speed_link=link)
    )
    times = np.linspace(0.0, plan.path.duration, 3000)
    rows = plan.path.positions(times)
    places = [model.kinematics.link_pose(link or model.tip, row).position for row in rows]
    speed = np.linalg.norm(np.diff(places, axis=0), axis=1).max() / times[1]
    assert 0.99 * most < speed <= most
    assert any('0.1 m/s' in note for note in plan.notes)
    share = quick.duration / plan.path.duration
    assert rows == pytest.approx(quick.positions(times * share), abs=1e-9)


@pytest.mark.parametrize(
    ('most', 'link', 'code', 'words'),
    [
        (float('nan'), '', PlanningCode.INVALID_GOAL_CONSTRAINTS, 'max_cartesian_speed is nan'),
        (-1.0, '', PlanningCode.INVALID_GOAL_CONSTRAINTS, 'max_cartesian_speed is -1'),
        (1.0, 'moon', PlanningCode.INVALID_LINK_NAME, "no link 'moon'"),
    ],
)
def test_a_speed_limit_that_is_none_is_refused(
    most: float, link: str, code: PlanningCode, words: str
) -> None:
    """Neither planner ignores it; a link without a speed limit has no effect."""
    start = ready('panda')
    for planner_id in ('', 'PTP'):
        asked = replace(
            request(start, frozen(start + 0.1)),
            planner_id=planner_id,
            max_cartesian_speed=most,
            cartesian_speed_link=link,
        )
        error = refusal(Planner(robot('panda')), asked)
        assert error.code is code
        assert words in str(error)
        assert Planner(robot('panda')).plan(replace(asked, max_cartesian_speed=0.0)).path.duration


def with_a_post(model: RobotModel, positions: Array) -> PlanningScene:
    """Return a scene with a box where the tip is at some positions."""
    at = model.pose(positions).position
    return with_box(model.scene, 'post', (0.1, 0.1, 0.1), tuple(at.tolist()))


def test_a_joint_goal_in_contact_is_reached_within_its_tolerance() -> None:
    """As MoveIt samples it; without a tolerance it is refused."""
    model = robot('gp110')
    goal = ready('gp110').copy()
    goal[0] += 0.8
    scene = with_a_post(model, goal)
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
