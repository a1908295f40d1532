# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Plans and sequences of groups: the joints beside each are where the robot has them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from itertools import count, pairwise
from types import SimpleNamespace
from typing import Any

from model_robots import two_arms_texts
from move_group_rig import joint_goal
from moveit_msgs import msg
import numpy as np
from planning_messages import QuietNode
from planning_scenes import distances
import pytest
from sensor_msgs.msg import JointState

from arm_model import Array, AttachedBody, Box, Clearances, CollisionObject, PlacedShape, Pose
from arm_planning import JointGoal, MotionRequest, PlanningCode, PlanningError
from arm_planning.ros.planning import GroupPlanners, PlannedMotion, PlanningThreads
from arm_planning.ros.robot_groups import RobotGroups
from arm_planning.ros.scene import pose_message, SceneSnapshot
from arm_planning.ros.scene_changes import scene_for
from arm_planning.ros.scene_monitor import SceneMonitor
from arm_planning.ros.services import RobotServices

ARMS = {'left_1': 0.0, 'left_2': 0.2, 'left_3': 0.0, 'right_1': 0.0, 'right_2': 1.0}
STANDING = {'torso': 0.1, **ARMS}


def item(group: str, radius: float = 0.0, planner: str = 'PTP', **goal: float) -> Any:
    """Return an item whose goal are joint positions in [rad]."""
    request = msg.MotionPlanRequest(group_name=group, planner_id=planner)
    request.goal_constraints = [joint_goal(list(goal.values()), list(goal))]
    return msg.MotionSequenceItem(req=request, blend_radius=radius)


def with_start(first: Any, places: Mapping[str, float]) -> Any:
    """Return an item with a start state."""
    state = JointState(name=list(places), position=list(places.values()))
    first.req.start_state.joint_state = state
    return first


def left(place: float, **fields: Any) -> Any:
    """Return a motion of the left arm."""
    return item('left', left_1=place, left_2=place, left_3=0.1 * place, **fields)


def right(place: float, **fields: Any) -> Any:
    """Return a motion of the right arm."""
    return item('right', right_1=place, right_2=place, **fields)


@pytest.fixture(name='thread')
def make_thread(monkeypatch: pytest.MonkeyPatch) -> PlanningThreads:
    """Return what plans for two arms, which stand still."""
    monkeypatch.setattr(SceneMonitor, '_publish', lambda _self: None)
    node: Any = QuietNode()
    monitor = SceneMonitor(node, RobotGroups(*two_arms_texts()))
    monitor._take_joints(JointState(name=list(STANDING), position=list(STANDING.values())))
    return PlanningThreads(node, monitor, node)


def planned(thread: PlanningThreads, *items: Any) -> PlannedMotion:
    """Plan a sequence."""
    return thread.prepare_sequence(items)()


def test_one_trajectory_for_each_change_of_the_group(thread: PlanningThreads) -> None:
    """Each begins where its group ended, and only the joints of its group are in it."""
    plan = planned(thread, left(0.3), left(0.5), right(0.4), left(0.1))
    first, second, third = (each.joint_trajectory for each in plan.trajectories)
    assert list(first.joint_names) == list(third.joint_names) == ['left_1', 'left_2', 'left_3']
    assert list(second.joint_names) == ['right_1', 'right_2']
    assert list(first.points[0].positions) == [0.0, 0.2, 0.0]
    assert list(second.points[0].positions) == [0.0, 1.0]
    assert list(first.points[-1].positions) == pytest.approx([0.5, 0.5, 0.05])
    assert list(third.points[0].positions) == pytest.approx(list(first.points[-1].positions))
    for each in (first, second, third):
        assert list(each.points[-1].velocities) == pytest.approx([0.0] * len(each.joint_names))
    places = dict(zip(plan.start.joint_state.name, plan.start.joint_state.position, strict=True))
    assert places == pytest.approx(STANDING)
    assert planned(thread).trajectories == []  # as in MoveIt, which has no objection


def test_each_group_may_have_a_start(thread: PlanningThreads) -> None:
    """The joints that it leaves out are where they are."""
    start = {'right_1': 0.2}
    plan = planned(thread, with_start(left(0.3), {'left_1': 0.1}), with_start(right(0.4), start))
    first, second = (each.joint_trajectory.points[0].positions for each in plan.trajectories)
    assert list(first) == [0.1, 0.2, 0.0]
    assert list(second) == [0.2, 1.0]


def test_a_cancel_ends_a_sequence_at_the_next_item(thread: PlanningThreads) -> None:
    """Also within the items of one group."""
    items, looks = [left(0.1 * number) for number in range(1, 9)], count(1)
    with pytest.raises(PlanningError, match='item 2: canceled') as caught:
        thread.prepare_sequence(items, is_canceled=lambda: next(looks) == 3)()
    assert caught.value.code is PlanningCode.PREEMPTED


def test_what_is_refused(thread: PlanningThreads) -> None:
    """With the number of the item, before anything is planned."""
    attached = right(0.1)
    attached.req.start_state.attached_collision_objects = [msg.AttachedCollisionObject()]
    for code, words, *items in (
        (PlanningCode.INVALID_MOTION_PLAN, 'item 0: blend radius -1', left(0.1, radius=-1.0)),
        (PlanningCode.INVALID_MOTION_PLAN, 'last item', left(0.1, radius=0.1)),
        (PlanningCode.INVALID_MOTION_PLAN, 'item 0 .* next moves right instead of left',
         left(0.1, radius=0.1), right(0.1)),
        (PlanningCode.INVALID_ROBOT_STATE, 'item 2 has a start state', left(0.1), right(0.1),
         with_start(left(0.2), {'left_1': 0.1})),
        (PlanningCode.INVALID_ROBOT_STATE, 'item 1 attaches', left(0.1), attached),
        (PlanningCode.INVALID_GROUP_NAME, 'item 1: group_name is empty', left(0.1), item('')),
        (PlanningCode.INVALID_GROUP_NAME, 'leg', left(0.1), item('leg')),
        (PlanningCode.PLANNING_FAILED, "item 1: no planner ''", left(0.1),
         right(0.1, planner='')),
        (PlanningCode.INVALID_GOAL_CONSTRAINTS, 'item 1', left(0.1), item('left', leg=1.0)),
    ):  # fmt: skip
        with pytest.raises(PlanningError, match=words) as caught:
            planned(thread, *items)
        assert caught.value.code is code, words


ACROSS = np.pi / 2  # where right_2 holds its bar across the left arm in [rad]

STATES = 100
MOTIONS = 6
SHARES = np.linspace(0.0, 1.0, 50).tolist()  # where a straight motion is looked at
STEP = 0.01  # time between two looks at a motion in [s]
SLACK = 1e-3  # how much less a pair may keep than nothing in [m], for looks between the planner's


@cache
def robot() -> RobotGroups:
    """Return two arms on a torso."""
    return RobotGroups(*two_arms_texts())


@cache
def snapshot() -> SceneSnapshot:
    """Return the scene in which the right arm holds a bar of 0.4 m."""
    forward = Pose(np.eye(3), np.array([0.25, 0.0, 0.0]))
    bar = CollisionObject('bar', PlacedShape(Box(0.4, 0.02, 0.02), forward))
    links = frozenset({'right_1_link', 'right_2_link', 'torso_link'})
    return SceneSnapshot(robot().scene.with_attached(AttachedBody(bar, 'right_2_link', links)))


def contacts(positions: Array) -> dict[tuple[str, str], float]:
    """Return which bodies of the whole robot touch, and how deep in [m]."""
    scene = snapshot().scene
    (measured,) = distances(scene, positions).tolist()
    pairs = zip(scene.pairs, measured, strict=True)
    return {pair: -distance for pair, distance in pairs if distance < 0.0}


def anywhere(draw: np.random.Generator) -> Array:
    """Return all joints, with the bar across the left arm."""
    places = dict(zip(robot().joints, draw.uniform(-1.2, 1.2, len(robot().joints)), strict=True))
    places |= {'right_1': 0.0, 'right_2': draw.normal(ACROSS, 0.3), 'left_3': 0.0}
    return robot().positions(places)


def test_the_scene_of_the_robot_allows_what_no_group_can_help() -> None:
    """Neighbouring links of every arm, not only of the group that comes first."""
    allowed = robot().scene.allowed
    for side, last in (('left', 3), ('right', 2)):
        links = ['torso_link', *(f'{side}_{number}_link' for number in range(1, last + 1))]
        assert all(allowed.allows(*pair) for pair in pairwise(links)), side
    assert not allowed.allows('left_3_link', 'right_2_link')


def test_a_default_of_the_matrix_counts_for_a_group_that_allows_the_pair() -> None:
    """A client has the pair checked by a default, with which an entry of the same is left out."""
    whole, model = robot().scene, robot().model('left')
    pair = ('torso_link', 'left_1_link')
    assert scene_for(SceneSnapshot(whole), model.scene).allowed.allows(*pair)
    matrix = replace(whole.allowed.without(pair[1]), defaults={pair[1]: False})
    scene = scene_for(SceneSnapshot(whole.with_allowed(matrix)), model.scene)
    assert not scene.allowed.allows(*pair)


def moved(positions: Array, left: Array) -> Array:
    """Return the robot with its left arm elsewhere."""
    joints = robot().model('left').joints
    by_joint = dict(zip(robot().joints, positions.tolist(), strict=True))
    return robot().positions({**by_joint, **dict(zip(joints, left.tolist(), strict=True))})


def test_a_group_touches_what_the_whole_robot_touches() -> None:
    """Wherever the joints beside it are: the same bodies, as far as the group moves them."""
    draw, planners, with_bar = np.random.default_rng(1), GroupPlanners(robot()), 0
    for _ in range(STATES):
        positions = anywhere(draw)
        model, _planner = planners.at('left', positions)
        scene = scene_for(snapshot(), model.scene)
        left = np.array([positions[robot().joints.index(name)] for name in model.joints])
        found = {each.bodies for each in Clearances(scene).contacts(left)}
        assert found == contacts(positions).keys() & set(scene.pairs)
        with_bar += any('bar' in bodies for bodies in found)
    assert with_bar > STATES / 20


def test_plans_lead_around_the_other_arm() -> None:
    """Where it is now: also where the straight way is free with all joints beside at 0."""
    draw, planners, in_the_way = np.random.default_rng(2), GroupPlanners(robot()), 0
    for _ in range(MOTIONS):
        start, goal = anywhere(draw), anywhere(draw)
        model, planner = planners.at('left', start)
        places = [robot().joints.index(name) for name in model.joints]
        scene = scene_for(snapshot(), model.scene)
        ends = start[places], goal[places]
        if any(planner.is_valid(end, scene) for end in ends):
            continue
        straight = [moved(start, ends[0] + share * (ends[1] - ends[0])) for share in SHARES]
        in_the_way += any(contacts(each) for each in straight)
        plan = planner.plan(MotionRequest(ends[0], (JointGoal(ends[1]),)), scene)
        for time in np.arange(0.0, plan.path.duration, STEP).tolist():
            there = moved(start, plan.path.at(time).position)
            assert all(depth < SLACK for depth in contacts(there).values())
        # it is kept while nothing beside its group moves
        assert planners.at('left', moved(start, ends[1]))[1] is planner
    assert in_the_way


def test_inverse_kinematics_has_the_torso_where_it_is() -> None:
    """A pose in the root link is reached by the whole robot, before and after the torso turned."""
    monitor: Any = SimpleNamespace(robot=robot())
    background: Any = SimpleNamespace(serve=lambda *_: None)
    node: Any = None
    kinematics, link = RobotServices(node, monitor, background), 'left_3_link'
    for torso in (0.4, -0.7):
        here = robot().positions({'torso': torso})
        wanted = robot().kinematics.link_pose(link, moved(here, np.array([0.3, -0.5, 0.2])))
        request = msg.PositionIKRequest(group_name='left', ik_link_name=link)
        request.pose_stamped.pose = pose_message(wanted)
        _response, state = kinematics._ik(request, snapshot(), here)
        by_joint = dict(zip(state.joint_state.name, state.joint_state.position, strict=True))
        found = robot().kinematics.link_pose(link, robot().positions(by_joint))
        assert found.position == pytest.approx(wanted.position, abs=1e-5)
        assert by_joint['torso'] == torso
