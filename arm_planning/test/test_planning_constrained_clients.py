# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Constraints that clients send, judged by their definitions and not by the planner's code."""

from __future__ import annotations

import math
from typing import Any

from move_group_rig import (
    action_goal,
    HAND,
    joint_goal,
    JOINTS,
    motion_request,
    MoveGroupRig,
    pose_goal,
    READY,
)
from moveit_msgs import msg
import numpy as np
from planning_messages import panda, pose_at
import pytest
from shape_msgs.msg import SolidPrimitive

from arm_model import Array, combined, Pose

DOWN = np.diag([1.0, -1.0, -1.0])  # the hand looks down, as it does at ready
GOAL = [0.303, 0.397, 1.997, -1.993, -0.37, 1.805, 1.306]
"""Another state in which the hand looks down in [rad]; it does not on the straight way there."""
LEVEL = 0.3  # tolerance in [rad]
JOINT4 = (-2.4, -1.85)  # [rad]


def hand(positions: Any) -> Pose:
    """Return the pose of the hand in the root link."""
    model = panda().model('panda_arm')
    assert (model.tip, list(model.joints)) == (HAND, JOINTS)
    return model.pose(np.array(positions))


def tilt(positions: Any) -> float:
    """Return the greater of the Euler angles about x and the new y, from looking down."""
    turn = DOWN.T @ hand(positions).rotation
    angles = math.atan2(-turn[1, 2], turn[2, 2]), math.asin(np.clip(turn[0, 2], -1.0, 1.0))
    return max(map(abs, angles))


def kept() -> msg.Constraints:
    """Return that the hand looks down, and that a joint stays in a range about no middle."""
    turn = msg.OrientationConstraint(link_name=HAND, weight=1.0)
    turn.header.frame_id = 'panda_link0'
    turn.orientation.x, turn.orientation.w = 1.0, 0.0
    turn.absolute_x_axis_tolerance = turn.absolute_y_axis_tolerance = LEVEL
    turn.absolute_z_axis_tolerance = math.pi
    joint = msg.JointConstraint(joint_name='panda_joint4', position=-2.2, weight=1.0)
    joint.tolerance_above, joint.tolerance_below = JOINT4[1] + 2.2, -2.2 - JOINT4[0]
    return msg.Constraints(joint_constraints=[joint], orientation_constraints=[turn])


def paths(rig: MoveGroupRig, request: msg.MotionPlanRequest) -> list[Array]:
    """Return the points of the plans of the service and of the action."""
    service = rig.plan(request)
    _status, action = rig.move(action_goal(request, plan_only=True))
    for code in (service.error_code, action.error_code):
        assert code.val == msg.MoveItErrorCodes.SUCCESS, code
    found = [each.joint_trajectory for each in (service.trajectory, action.planned_trajectory)]
    assert [list(each.joint_names) for each in found] == [JOINTS] * 2
    return [np.array([point.positions for point in each.points]) for each in found]


def test_path_constraints_of_clients_hold_at_every_point(rig: MoveGroupRig) -> None:
    """Of both interfaces; the straight motion breaks that of the orientation."""
    assert max(map(tilt, np.linspace(READY, GOAL, 50))) > LEVEL + 0.05
    request = motion_request(joint_goal(GOAL), path_constraints=kept())
    request.allowed_planning_time = 60.0
    for path in paths(rig, request):
        assert len(path) > 10
        assert max(map(tilt, path)) < LEVEL + 1e-6
        assert JOINT4[0] - 1e-6 < path[:, 3].min() <= path[:, 3].max() < JOINT4[1] + 1e-6
        assert path[-1] == pytest.approx(GOAL, abs=1e-3)


def test_a_point_beside_the_hand_stays_in_a_turned_box_or_goes_into_it(rig: MoveGroupRig) -> None:
    """As a path constraint and as a goal; the box is long in one direction: along y."""
    beside = Pose(np.eye(3), np.array([0.0, 0.05, 0.1]))
    aside = [0.4, *READY[1:]]
    for between, of_path in ([0.2, *READY[1:]], True), (GOAL, False):
        centre = combined(hand(between), beside).position
        (place,) = pose_goal(pose_at(*centre.tolist()), HAND, 'panda_link0').position_constraints
        place.target_point_offset.y, place.target_point_offset.z = beside.position[1:].tolist()
        box = SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[0.2, 0.05, 0.05])
        place.constraint_region.primitives = [box]
        turn = place.constraint_region.primitive_poses[0].orientation
        turn.z = turn.w = math.sqrt(0.5)
        wanted = msg.Constraints(position_constraints=[place])
        request = motion_request(joint_goal(aside), path_constraints=wanted)
        if not of_path:
            request = motion_request(wanted)
        for path in paths(rig, request):
            looks = path if of_path else path[-1:]
            off = np.abs([combined(hand(each), beside).position - centre for each in looks])
            assert (off <= np.array([0.05, 0.2, 0.05]) / 2 + 1e-5).all(), off.max(axis=0)
