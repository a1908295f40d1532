# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Path constraints that clients send, judged by their definition and not by the planner's code.

The test knows the URDF only: the frames of the links, the angles of a turn, and the polynomials
between the points of a trajectory are computed here.
"""

from __future__ import annotations

from collections.abc import Callable
from copy import deepcopy
from functools import partial
import math
from typing import Any
from xml.etree import ElementTree as ET

from geometry_msgs.msg import Pose as PoseMessage
from geometry_msgs.msg import Quaternion
from model_robots import forward
from move_group_rig import (
    action_goal,
    HAND,
    joint_goal,
    JOINTS,
    motion_request,
    MoveGroupRig,
    pose_goal,
    READY,
    robots,
)
from moveit_msgs import msg
import numpy as np
from numpy.typing import NDArray
import pinocchio as pin
from planning_messages import pose_at
import pytest
from shape_msgs.msg import SolidPrimitive
from urdf_reader import expand_xacro

from arm_model.ros import seconds

Array = NDArray[np.float64]
START = READY
GOAL = [0.303, 0.397, 1.997, -1.993, -0.37, 1.805, 1.306]
"""Another state in which the hand looks down in [rad]; it does not on the straight way there."""
BASE = 'panda_link0'
STEP = 4e-3  # time between two looks in [s]
URDF = ET.fromstring(expand_xacro(robots() / 'panda' / 'panda.urdf.xacro'))  # noqa: S314


def hand(positions: Array) -> Array:
    """Return the pose of the hand in the root link (4, 4)."""
    return forward(URDF, dict(zip(JOINTS, positions.tolist(), strict=True)), HAND)


def between(first: Any, second: Any, times: Array) -> Array:
    """Return positions on the quintic between two points of a trajectory."""
    begin, end = seconds(first.time_from_start), seconds(second.time_from_start)

    def rows(time: float) -> Array:
        """Return the powers of a time, and their first and second derivative."""
        powers = [
            [math.perm(n, order) * time ** max(n - order, 0) for n in range(6)]
            for order in range(3)
        ]
        return np.array(powers)

    ends = [(each.positions, each.velocities, each.accelerations) for each in (first, second)]
    matrix = np.vstack([rows(0.0), rows(end - begin)])
    coefficients = np.linalg.solve(matrix, np.vstack(ends))
    return np.asarray((times - begin)[:, None] ** np.arange(6) @ coefficients)


def states(trajectory: Any) -> Array:
    """Return the joint positions of a trajectory, densely."""
    assert list(trajectory.joint_names) == JOINTS
    found = []
    for first, second in zip(trajectory.points, trajectory.points[1:], strict=False):
        begin, end = seconds(first.time_from_start), seconds(second.time_from_start)
        count = max(int((end - begin) / STEP), 1)
        found.append(between(first, second, np.linspace(begin, end, count + 1)))
    return np.vstack(found)


def angles(rotation: Array) -> dict[int, Array]:
    """Return the rotation vector, and the angles about x, the new y and the new z."""
    (_, _, y), (_, _, x), (_, _, w) = rotation.tolist()
    found = [math.atan2(-x, w), math.asin(max(-1.0, min(1.0, y)))]
    return {
        msg.OrientationConstraint.XYZ_EULER_ANGLES: np.array(found),
        msg.OrientationConstraint.ROTATION_VECTOR: pin.log3(rotation),
    }


def cases() -> dict[str, tuple[msg.Constraints, Callable[[Array], float]]]:
    """Return constraints, and by how much a state misses them.

    The hand looks down; a point 0.1 m below the flange stays in a box above 0.4 m; a joint stays
    between two positions that are not as far on either side.
    """
    down = PoseMessage(orientation=Quaternion(x=1.0, w=0.0))
    level = pose_goal(down, HAND, BASE).orientation_constraints[0]
    level.absolute_x_axis_tolerance = level.absolute_y_axis_tolerance = 0.3
    level.absolute_z_axis_tolerance = math.pi
    vector = deepcopy(level)
    vector.parameterization = msg.OrientationConstraint.ROTATION_VECTOR
    place = pose_goal(pose_at(0.0, 0.0, 0.6), HAND, BASE).position_constraints[0]
    place.target_point_offset.z = 0.1
    slab = SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[2.0, 2.0, 0.4])
    place.constraint_region.primitives = [slab]
    joint = joint_goal([-2.2], ['panda_joint4'])
    joint.joint_constraints[0].tolerance_above = 0.35
    joint.joint_constraints[0].tolerance_below = 0.2

    def tilted(kind: int, positions: Array) -> float:
        turned = angles(np.diag([1.0, -1.0, -1.0]) @ hand(positions)[:3, :3])[kind]
        return float(np.abs(turned[:2]).max()) - 0.3

    def outside(positions: Array) -> float:
        point = hand(positions) @ np.array([0.0, 0.0, 0.1, 1.0])
        return float((np.abs(point[:3] - [0.0, 0.0, 0.6]) - [1.0, 1.0, 0.2]).max())

    return {
        'euler angles': (
            msg.Constraints(orientation_constraints=[level]),
            partial(tilted, msg.OrientationConstraint.XYZ_EULER_ANGLES),
        ),
        'rotation vector': (
            msg.Constraints(orientation_constraints=[vector]),
            partial(tilted, msg.OrientationConstraint.ROTATION_VECTOR),
        ),
        'region': (msg.Constraints(position_constraints=[place]), outside),
        'joint': (joint, lambda at: float(max(at[3] + 1.85, -2.4 - at[3]))),
    }


CASES = cases()


def request(constraints: msg.Constraints, goal: list[float]) -> msg.MotionPlanRequest:
    """Return a request under path constraints."""
    asked = motion_request(joint_goal(goal), path_constraints=constraints)
    asked.allowed_planning_time = 60.0
    return asked


@pytest.mark.parametrize('case', CASES)
def test_path_constraints_of_clients_hold_everywhere(rig: MoveGroupRig, case: str) -> None:
    """Of both interfaces; the straight motion breaks all but that of a joint."""
    constraints, beyond = CASES[case]
    assert beyond(np.array(START)) < 0.0
    assert beyond(np.array(GOAL)) < 0.0, beyond(np.array(GOAL))
    straight = np.linspace(START, GOAL, 50)
    assert case == 'joint' or max(beyond(each) for each in straight) > 0.05
    service = rig.plan(request(constraints, GOAL))
    assert service.error_code.val == msg.MoveItErrorCodes.SUCCESS, service.error_code
    _status, action = rig.move(action_goal(request(constraints, GOAL), plan_only=True))
    assert action.error_code.val == msg.MoveItErrorCodes.SUCCESS, action.error_code
    for trajectory in (service.trajectory, action.planned_trajectory):
        path = states(trajectory.joint_trajectory)
        assert max(beyond(each) for each in path) < 1e-6
        assert path[-1] == pytest.approx(GOAL, abs=1e-3)
