# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sequences of MoveIt's requests: what is refused, and trajectories of several groups."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import count
from typing import Any

from model_robots import two_arms_texts
from moveit_msgs.msg import (
    AttachedCollisionObject,
    Constraints,
    JointConstraint,
    MotionPlanRequest,
    MotionSequenceItem,
)
from planning_messages import QuietNode
import pytest
from sensor_msgs.msg import JointState

from arm_planning import PlanningCode, PlanningError
from arm_planning.ros.planning import PlannedMotion, PlanningThreads
from arm_planning.ros.robot_groups import RobotGroups
from arm_planning.ros.scene_monitor import SceneMonitor

ARMS = {'left_1': 0.0, 'left_2': 0.2, 'left_3': 0.0, 'right_1': 0.0, 'right_2': 1.0}
STANDING = {'torso': 0.1, **ARMS}


def item(group: str, radius: float = 0.0, planner: str = 'PTP', **goal: float) -> Any:
    """Return an item whose goal are joint positions in [rad]."""
    request = MotionPlanRequest(group_name=group, planner_id=planner)
    request.goal_constraints = [
        Constraints(
            joint_constraints=[
                JointConstraint(joint_name=name, position=position, weight=1.0)
                for name, position in goal.items()
            ]
        )
    ]
    return MotionSequenceItem(req=request, blend_radius=radius)


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


def test_no_items_are_no_motion(thread: PlanningThreads) -> None:
    """As in MoveIt, which has no objection."""
    assert planned(thread).trajectories == []


def test_what_is_refused(thread: PlanningThreads) -> None:
    """With the number of the item, before anything is planned."""
    attached = right(0.1)
    attached.req.start_state.attached_collision_objects = [AttachedCollisionObject()]
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
