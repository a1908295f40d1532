# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Industrial motion: on its line or arc, within limits between samples, refused in words."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from itertools import pairwise

from hypothesis import assume, example, given, settings
from hypothesis import strategies as st
from model_robots import chain, ready, robot, ROBOTS
import numpy as np
import pinocchio as pin
from planning_scenes import broken_limits
import pytest

from arm_model import Array, CollisionObject, frozen, PlanningScene, Pose, RobotModel, Sphere
from arm_planning import (
    CircPoint,
    CircPointKind,
    Goal,
    JointGoal,
    MotionPlan,
    MotionRequest,
    PathConstraints,
    Planner,
    PlanningCode,
    PlanningError,
    PoseGoal,
    SequenceItem,
)
from arm_planning.cartesian import arc_around, arc_through, Curve, Line
from arm_planning.ik import IkSolver
from arm_planning.link_kinematics import LinkKinematics
from arm_planning.pilz_motions import CartesianLimits
from arm_trajectory import Path

pytestmark = pytest.mark.slow

STRAIGHT = 1e-4  # how far a link may be off its line or arc in [m]
TURNED = 1e-3  # how far it may be turned off it in [rad]

CODE = PlanningCode

seeds = st.integers(0, 10**6)


@cache
def planner(name: str) -> Planner:
    """Return the planner of a robot."""
    return Planner(robot(name))


@cache
def alone(name: str) -> PlanningScene:
    """Return a scene in which nothing collides."""
    return robot(name).scene.allowing('*', '*')


def motion(name: str, wanted: MotionRequest) -> MotionPlan:
    """Plan a motion where nothing collides."""
    return planner(name).plan(wanted, alone(name))


@cache
def tip(name: str) -> LinkKinematics:
    """Return the kinematics of a robot's tip."""
    return LinkKinematics(robot(name))


def moved(name: str, way: Array, turn: Array | None = None) -> Pose:
    """Return the pose of the tip at the ready pose, moved and turned."""
    pose = tip(name).pose(ready(name))
    rotation = pose.rotation if turn is None else pin.exp3(turn) @ pose.rotation
    return Pose(rotation, pose.position + way)


def request(name: str, kind: str, goal: Goal | Pose, **others: object) -> MotionRequest:
    """Return a request that begins at the ready pose."""
    goals = [PoseGoal(goal) if isinstance(goal, Pose) else goal]
    return replace(MotionRequest(ready(name), goals, kind), **others)  # type: ignore[arg-type]


def places(path: Path, count: int) -> Array:
    """Return positions at times that are no multiples of those of the segments."""
    return path.positions(np.sort(np.random.default_rng(0).uniform(0.0, path.duration, count)))


def off(curve: Curve, link: LinkKinematics, positions: Array) -> tuple[float, float]:
    """Return how far a link is off a curve in [m] and [rad]."""
    pose = link.pose(positions)
    wanted = curve.at(min(max(curve.nearest(pose.position), 0.0), 1.0))
    turn = np.linalg.norm(pin.log3(wanted.rotation @ pose.rotation.T))
    return float(np.linalg.norm(pose.position - wanted.position)), float(turn)


def check_limits(model: RobotModel, path: Path) -> None:
    """Check that limits hold, that the path goes from rest to rest, and that nothing jumps."""
    assert broken_limits(path, model.limits, 0.03) == []
    for end in (path.at(0.0), path.at(path.duration)):
        assert np.abs(end.velocity).max() < 1e-6
        assert np.abs(end.acceleration).max() < 1e-4
    numbers = np.arange(len(path.durations))
    for order, tolerance in enumerate((1e-9, 1e-6, 1e-4)):
        before = path.derived(order, numbers, path.durations)[:-1]
        after = path.derived(order, numbers, np.zeros(len(numbers)))[1:]
        assert np.abs(before - after).max(initial=0.0) < tolerance


def check_on(curve: Curve, name: str, path: Path, count: int) -> None:
    """Check the distance of the tip from a curve, and the limits of the joints."""
    for positions in places(path, count):
        way, turn = off(curve, tip(name), positions)
        assert way < STRAIGHT
        assert turn < TURNED
    check_limits(robot(name), path)


def planned(name: str, wanted: MotionRequest) -> MotionPlan | None:
    """Return a plan; None where it was refused in words that name the place or the joint."""
    try:
        return motion(name, wanted)
    except PlanningError as error:
        is_on_the_way = error.code is PlanningCode.PLANNING_FAILED and 'of the way' in str(error)
        if not is_on_the_way and error.code is not PlanningCode.NO_IK_SOLUTION:
            raise
        return None


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=25, deadline=None)
@given(seed=seeds, factor=st.sampled_from([0.1, 0.5, 1.0]), spot=st.booleans())
def test_lin_stays_on_its_line(name: str, seed: int, factor: float, spot: bool) -> None:
    """To 0.1 mm, or on the spot, turning about one axis, within all limits, and ends at the goal.

    Speed and turn of the tip have limits of their own.
    """
    rng = np.random.default_rng(seed)
    way = np.zeros(3) if spot else rng.uniform(-0.2, 0.2, 3)
    goal = moved(name, way, rng.uniform(-0.5, 0.5, 3))
    found = planned(name, request(name, 'LIN', goal, velocity_scaling=factor))
    assume(found is not None)
    assert found is not None
    begin = tip(name).pose(ready(name))
    if spot:
        check_limits(robot(name), found.path)
        for positions in places(found.path, 100):
            assert tip(name).pose(positions).position == pytest.approx(
                begin.position, abs=STRAIGHT
            )
    else:
        check_on(Line(begin, goal), name, found.path, 300)
    end = tip(name).pose(found.path.end.position)
    assert end.position == pytest.approx(goal.position, abs=1e-8)
    assert end.rotation == pytest.approx(goal.rotation, abs=1e-8)
    step = found.path.duration / 400
    poses = [tip(name).pose(each) for each in found.path.positions(step * np.arange(401.0))]
    for one, other in pairwise(poses):
        most = 1.01 * factor * step
        assert (
            np.linalg.norm(other.position - one.position) < CartesianLimits().max_trans_vel * most
        )
        turn = np.linalg.norm(pin.log3(one.rotation.T @ other.rotation))
        assert turn < CartesianLimits().max_rot_vel * most


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=15, deadline=None)
@given(seed=seeds, center=st.booleans())
@example(seed=29862, center=False)  # prbt: slowed between two places, far from a line in time
def test_circ_stays_on_its_arc(name: str, seed: int, center: bool) -> None:
    """To 0.1 mm, through its point or about its center, within all limits."""
    rng = np.random.default_rng(seed)
    begin = tip(name).pose(ready(name))
    first, second = np.linalg.qr(rng.normal(size=(3, 3)))[0][:2]
    radius, sweep = rng.uniform(0.04, 0.1), rng.uniform(0.8, 2.8)
    middle = begin.position - radius * first

    def on_circle(angle: float) -> Array:
        place: Array = middle + radius * (np.cos(angle) * first + np.sin(angle) * second)
        return place

    goal = Pose(begin.rotation, on_circle(sweep))
    via = CircPoint(CircPointKind.CENTER, middle)
    arc = arc_around(begin, middle, goal)
    if not center:
        via = CircPoint(CircPointKind.INTERIM, on_circle(0.4 * sweep))
        arc = arc_through(begin, via.position, goal)
    for share in (0.2, 0.8):
        assert arc.at(share).position == pytest.approx(on_circle(share * sweep), abs=1e-6)
        before, after = (arc.at(share + shift).position for shift in (-1e-6, 1e-6))
        assert arc.twist(share)[:3] == pytest.approx((after - before) / 2e-6, abs=1e-6)
    wide = arc_through(begin, on_circle(2.0), Pose(begin.rotation, on_circle(5.0)))
    assert wide.length == pytest.approx(5.0 * radius)
    assert wide.nearest(on_circle(4.0)) == pytest.approx(0.8)
    found = planned(name, request(name, 'CIRC', goal, via=via))
    assume(found is not None)
    assert found is not None
    check_on(arc, name, found.path, 200)


@pytest.mark.parametrize('name', ROBOTS)
@settings(max_examples=40, deadline=None)
@given(seed=seeds, factor=st.sampled_from([0.01, 0.3, 1.0]))
@example(seed=321, factor=1.0)  # a phase of its profile is as short as rounding
def test_ptp_is_straight_and_in_phase(name: str, seed: int, factor: float) -> None:
    """Joints share one profile; one of them is at a limit of it."""
    rng, limits = np.random.default_rng(seed), robot(name).limits
    goal = rng.uniform(limits.lower, limits.upper)
    wanted = request(name, 'PTP', JointGoal(goal), velocity_scaling=factor)
    path = motion(name, wanted).path
    way = goal - ready(name)
    for positions in places(path, 50):
        shares = (positions - ready(name)) / way
        assert np.ptp(shares) < 1e-6 / np.abs(way).min()
    assert path.end.position == pytest.approx(goal, abs=1e-9)
    check_limits(robot(name), path)
    speeds = [np.abs(path.at(each).velocity) for each in np.linspace(0, path.duration, 99)]
    assert np.max(speeds / limits.velocity) <= factor * (1 + 1e-6)


@pytest.mark.parametrize('name', ROBOTS)
def test_a_motion_to_where_the_arm_is(name: str) -> None:
    """It is allowed, short, and moves nothing."""
    for kind in ('PTP', 'LIN'):
        for goal in (JointGoal(ready(name)), moved(name, np.zeros(3))):
            path = motion(name, request(name, kind, goal)).path
            assert path.duration < 0.1
            assert np.abs(places(path, 10) - ready(name)).max() < 1e-6


def test_a_line_gets_slower_instead_of_failing() -> None:
    """Next to a singularity a joint meets its limit; the note names it."""
    name = 'prbt'
    start = frozen([0.0, 0.3, 1.6, 0.0, 0.05, 0.0])  # the wrist is almost straight
    pose = tip(name).pose(start)
    goal = PoseGoal(Pose(pose.rotation, pose.position + np.array([0.0, 0.12, 0.0])))
    plan = motion(name, MotionRequest(start, [goal], 'LIN'))
    assert any('slowed to' in note and 'prbt_joint_' in note for note in plan.notes)
    check_on(Line(pose, goal.pose), name, plan.path, 300)


@pytest.mark.parametrize('way', [(0.0, 0.0, -0.05), (-0.05, 0.0, -0.02), (0.05, 0.0, 0.0)])
def test_a_line_may_begin_with_a_straight_wrist(way: tuple[float, ...]) -> None:
    """Where it leads in the plane of the arm; beside it the wrist would have to turn first."""
    straight = frozen([0.0] * 6)
    pose = tip('gp110').pose(straight)
    goal = PoseGoal(Pose(pose.rotation, pose.position + np.array(way)))
    path = motion('gp110', MotionRequest(straight, [goal], 'LIN')).path
    check_on(Line(pose, goal.pose), 'gp110', path, 300)
    beside = PoseGoal(Pose(pose.rotation, pose.position + np.array([0.0, 0.05, 0.0])))
    with pytest.raises(PlanningError, match=r'singular at 0% of the way'):
        motion('gp110', MotionRequest(straight, [beside], 'LIN'))


@pytest.mark.parametrize('way', [(0.0, 0.0, 0.05), (-0.05, 0.0, 0.03), (0.05, 0.0, 0.0)])
def test_a_line_may_be_singular_all_the_way(way: tuple[float, ...]) -> None:
    """Axes of a wrist like that of a UR stay parallel while it moves in the plane of the arm."""
    model, start = chain('zyyyzy'), frozen([0.0, 0.5, 0.8, 0.4, 0.0, 0.0])
    link = LinkKinematics(model)
    pose = link.pose(start)
    line = Line(pose, Pose(pose.rotation, pose.position + np.array(way)))
    scene = model.scene.allowing('*', '*')
    path = Planner(model).plan(MotionRequest(start, [PoseGoal(line.at(1.0))], 'LIN'), scene).path
    worst = np.max([off(line, link, positions) for positions in places(path, 100)], axis=0)
    assert (worst < [STRAIGHT, TURNED]).all()
    end = link.pose(path.positions(np.array([path.duration]))[0])
    assert end.position == pytest.approx(line.at(1.0).position, abs=STRAIGHT)


def test_a_line_that_cannot_be_followed_is_refused_with_its_place() -> None:
    """Through a singularity, out of reach, or with its end in another configuration."""
    here = frozen([0.0, 0.5, 1.2, 0.3, 1.0, 0.2])
    pose = tip('prbt').pose(here)
    near = Pose(pose.rotation, pose.position + np.array([0.0, 0.03, 0.0]))
    same, other = IkSolver(robot('prbt')).solve(near, here)[:2]
    assert motion('prbt', MotionRequest(here, [JointGoal(same)], 'LIN'))
    straight, bent = frozen([0.0] * 6), frozen([0.0, 0.3, 0.6, 0.3, 0.7, 0.0])
    pose = tip('prbt').pose(straight)
    below = PoseGoal(Pose(pose.rotation, pose.position - np.array([0.0, 0.0, 0.2])))
    far = PoseGoal(moved('prbt', np.array([0.0, 2.0, 0.0])))
    extended = PoseGoal(tip('prbt').pose(frozen([0.0, 0.4, 0.0, 0.3, 0.7, 0.0])))
    failed, changed = PlanningCode.PLANNING_FAILED, PlanningCode.GOAL_CONSTRAINTS_VIOLATED
    for start, goal, code, words in (
        (straight, below, failed, r'LIN: .* 0% of the way.*PTP'),
        (ready('prbt'), far, PlanningCode.NO_IK_SOLUTION, r'out of reach by \d'),
        (bent, extended, failed, r'beyond 100% of the way'),
        (here, JointGoal(other), changed, 'another configuration; use PTP'),
    ):
        with pytest.raises(PlanningError, match=words) as refused:
            motion('prbt', MotionRequest(start, [goal], 'LIN'))
        assert refused.value.code is code, words
    model, start = chain('zyyyz'), frozen([0.0, 0.5, 0.8, 0.4, 0.0])
    goal = JointGoal(np.add(start, [0.1, -0.1, 0.05, 0.2, 0.3]))
    with pytest.raises(PlanningError, match='its 5 joints cannot turn the link'):
        Planner(model).plan(MotionRequest(start, [goal], 'LIN'), model.scene)


def test_contact_on_the_way_names_pair_and_place() -> None:
    """A ball on the line, which start and goal do not touch."""
    name = 'gp110'
    way = np.array([0.0, -0.6, 0.0])
    ball = CollisionObject('ball', Sphere(0.03), pose=moved(name, 0.5 * way))
    scene = robot(name).scene.with_object(ball)
    for kind in ('LIN', 'PTP'):
        with pytest.raises(PlanningError, match=r'touches ball.* \d+% .* at \(') as refused:
            planner(name).plan(request(name, kind, moved(name, way)), scene)
        assert refused.value.code is PlanningCode.INVALID_MOTION_PLAN
    assert planner(name).plan(request(name, 'LIN', moved(name, -0.5 * way)), scene)


def test_a_second_goal_is_taken_when_the_first_is_refused() -> None:
    """Alternatives: the first that is reached."""
    far, near = (PoseGoal(moved('prbt', np.array([0.0, y, 0.0]))) for y in (2.0, 0.05))
    plan = motion('prbt', MotionRequest(ready('prbt'), [far, near], 'LIN'))
    end = tip('prbt').pose(plan.path.end.position)
    assert end.position == pytest.approx(near.pose.position, abs=1e-8)
    with pytest.raises(PlanningError, match=r'goal 0: .*goal 1: '):
        motion('prbt', MotionRequest(ready('prbt'), [far, far], 'LIN'))


CORNERS = ((0.0, 0.12, 0.0), (0.0, 0.12, -0.12), (0.0, 0.0, -0.12))


def items(name: str, kinds: str, radius: float) -> list[SequenceItem]:
    """Return a sequence around a square, blended at its inner corners."""
    names = {'L': 'LIN', 'P': 'PTP'}
    return [
        SequenceItem(
            request(name, names[kind], moved(name, np.array(corner))),
            radius if number < len(kinds) - 1 else 0.0,
        )
        for number, (kind, corner) in enumerate(zip(kinds, CORNERS, strict=True))
    ]


@pytest.mark.parametrize('name', ROBOTS)
@pytest.mark.parametrize('kinds', ['LLL', 'PLP', 'LPL'])
def test_blends_stay_in_their_spheres(name: str, kinds: str) -> None:
    """Outside of the spheres lines are lines; inside, nothing stops and no limit is broken."""
    radius = 0.03
    plan, stops = (
        planner(name).plan_sequence(items(name, kinds, each), alone(name)) for each in (radius, 0)
    )
    check_limits(robot(name), plan.path)
    check_limits(robot(name), stops.path)
    start = tip(name).pose(ready(name)).position
    corners = [start, *(start + np.array(corner) for corner in CORNERS)]
    if kinds == 'LLL':
        assert plan.path.duration < stops.path.duration
        lines = [Line(Pose(np.eye(3), a), Pose(np.eye(3), b)) for a, b in pairwise(corners)]
        for row in places(plan.path, 500):
            place = tip(name).pose(row).position
            ways = [
                np.linalg.norm(place - line.at(min(max(line.nearest(place), 0.0), 1.0)).position)
                for line in lines
            ]
            inside = min(np.linalg.norm(place - corner) for corner in corners[1:-1]) <= radius
            assert inside or min(ways) < STRAIGHT
    inner = plan.path.positions(np.linspace(0.0, plan.path.duration, 800))
    positions = np.array([tip(name).pose(row).position for row in inner])
    for corner in corners[1:-1]:
        assert np.linalg.norm(positions - corner, axis=1).min() < radius
    speeds = np.linalg.norm(np.diff(positions, axis=0), axis=1)[20:-20]
    assert speeds.min() > 0.0
    assert tip(name).pose(plan.path.end.position).position == pytest.approx(corners[-1], abs=1e-7)


@pytest.mark.parametrize('radius', [0.0, 0.03])
def test_a_sequence_heeds_path_constraints(radius: float) -> None:
    """Those of one motion count for it alone, or for all that are blended with it."""
    motions = items('prbt', 'PPP', radius)
    ends = [motions[0].at(None).start]
    for item in motions:
        only = replace(item.at(None), start=ends[-1])
        ends.append(motion('prbt', only).path.end.position)
    joint = int(np.abs(ends[1] - ends[0]).argmax())
    name, (began, ended) = robot('prbt').joints[joint], (ends[0][joint], ends[1][joint])
    middle = 0.5 * (began + ended)

    def sequence(number: int, lower: float, upper: float) -> MotionPlan:
        """Plan with a constraint of one motion."""
        constraints = PathConstraints({name: (lower, upper)})
        item = motions[number]
        limited = replace(item, request=replace(item.at(None), constraints=constraints))
        changed = [*motions[:number], limited, *motions[number + 1 :]]
        return planner('prbt').plan_sequence(changed, alone('prbt'))

    assert sequence(0, -np.pi, np.pi).path.duration > 0.0
    with pytest.raises(PlanningError, match=f'PTP breaks a path constraint .* {name}') as refused:
        sequence(0, min(began, middle), max(began, middle))
    assert refused.value.code is PlanningCode.INVALID_MOTION_PLAN
    reached = sorted((ends[1][joint], ends[2][joint]))
    for_second = reached[0] - 1e-3, reached[1] + 1e-3
    if radius:
        with pytest.raises(PlanningError, match='in all motions that are blended'):
            sequence(1, *for_second)
    else:
        assert sequence(1, *for_second).path.duration > 0.0


def test_sequences_by_the_rules_of_pilz() -> None:
    """No items, a negative radius, a last one, overlaps, several goals: refused with the item."""
    good = items('prbt', 'LLL', 0.03)
    far = request('prbt', 'LIN', moved('prbt', np.array([0.0, 2.0, 0.0])))
    bad = CODE.INVALID_MOTION_PLAN
    cases: list[tuple[str, PlanningCode, list[SequenceItem]]] = [
        ('no items', bad, []),
        ('item 0: blend radius -1', bad, [replace(good[0], blend_radius=-1.0), *good[1:]]),
        ('last item', bad, [*good[:2], replace(good[2], blend_radius=0.01)]),
        ('items 0 and 1 overlap', bad, items('prbt', 'LLL', 0.07)),
        ('holds all of item 0', bad, [replace(good[0], blend_radius=0.13), good[2]]),
        (r'item 1: .*out of reach by', CODE.NO_IK_SOLUTION, [good[0], SequenceItem(far)]),
    ]
    for words, code, wrong in cases:
        with pytest.raises(PlanningError, match=words) as refused:
            planner('prbt').plan_sequence(wrong)
        assert refused.value.code is code, words


def test_circles_that_are_none_have_the_codes_of_pilz() -> None:
    """No point, radii that differ, points on a line."""
    begin = tip('prbt').pose(ready('prbt')).position
    goal = moved('prbt', np.array([0.0, 0.1, 0.0]))
    for words, kind, way in (
        ('on a line', CircPointKind.INTERIM, (0.0, 0.05, 0.0)),
        ('half a circle', CircPointKind.CENTER, (0.0, 0.05, 0.0)),
        ('may differ', CircPointKind.CENTER, (0.05, 0.0, 0.0)),
        ('no interim or center point', None, (0.0, 0.0, 0.0)),
    ):
        via = kind and CircPoint(kind, begin + np.array(way))
        with pytest.raises(PlanningError, match=words) as refused:
            motion('prbt', request('prbt', 'CIRC', goal, via=via))
        assert refused.value.code is CODE.INVALID_MOTION_PLAN, words


def test_cartesian_limits_are_checked() -> None:
    """Of a file of Pilz: other keys are passed over, what is wrong is named."""
    table = {'max_trans_vel': 0.5, 'max_trans_dec': -1, 'max_rot_acc': 9.0}
    assert CartesianLimits.of_table(table) == CartesianLimits(0.5, max_trans_dec=-1.0)
    for wrong in ({'max_rot_vel': 0.0}, {'max_trans_dec': 5.0}, {'max_trans_acc': 'fast'}):
        with pytest.raises(PlanningError, match='cartesian_limits'):
            CartesianLimits.of_table(wrong)
