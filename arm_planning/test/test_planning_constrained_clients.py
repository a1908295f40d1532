# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Path constraints that clients send, judged by their definition and not by the planner's code.

The test knows the URDF only: the frames of the links, the angles of a turn, and the polynomials
between the points of a trajectory are computed here.
"""

from __future__ import annotations

from collections.abc import Callable
import math
from typing import Any
from xml.etree import ElementTree as ET

from model_robots import forward
from move_group_rig import (
    action_goal,
    HAND,
    joint_goal,
    JOINTS,
    motion_request,
    MoveGroupRig,
    READY,
    robots,
)
from moveit_msgs.msg import (
    Constraints,
    JointConstraint,
    MotionPlanRequest,
    MoveItErrorCodes,
    OrientationConstraint,
    PositionConstraint,
)
import numpy as np
from numpy.typing import NDArray
from planning_messages import pose_at
import pytest
from shape_msgs.msg import SolidPrimitive
from urdf_reader import expand_xacro

from arm_model.ros import seconds

Array = NDArray[np.float64]
START = READY
GOAL = [0.303, 0.397, 1.997, -1.993, -0.37, 1.805, 1.306]
"""Another state in which the hand looks down in [rad]; it does not on the straight way there."""
STEP = 4e-3  # time between two looks in [s]
URDF = ET.fromstring(expand_xacro(robots() / 'panda' / 'panda.urdf.xacro'))  # noqa: S314


def hand(positions: Array) -> Array:
    """Return the pose of the hand in the root link (4, 4)."""
    return forward(URDF, dict(zip(JOINTS, positions.tolist(), strict=True)), HAND)


def between(first: Any, second: Any, times: Array) -> Array:
    """Return positions on the quintic between two points of a trajectory."""
    begin, end = seconds(first.time_from_start), seconds(second.time_from_start)
    lasts = end - begin
    powers = np.array([[lasts**n for n in range(6)]])
    rates = np.array([[n * lasts ** (n - 1) if n else 0.0 for n in range(6)]])
    bends = np.array([[n * (n - 1) * lasts ** (n - 2) if n > 1 else 0.0 for n in range(6)]])
    start = np.eye(6)[:3] * np.array([[1.0], [1.0], [2.0]])
    matrix = np.vstack([start, powers, rates, bends])
    given = np.array(
        [
            *(first.positions, first.velocities, first.accelerations),
            *(second.positions, second.velocities, second.accelerations),
        ]
    )
    coefficients = np.linalg.solve(matrix, given)
    local = (times - begin)[:, None] ** np.arange(6)
    return np.asarray(local @ coefficients)


def states(trajectory: Any) -> Array:
    """Return the joint positions of a trajectory, densely."""
    assert list(trajectory.joint_names) == JOINTS
    found = []
    for first, second in zip(trajectory.points, trajectory.points[1:], strict=False):
        begin, end = seconds(first.time_from_start), seconds(second.time_from_start)
        count = max(int((end - begin) / STEP), 1)
        found.append(between(first, second, np.linspace(begin, end, count + 1)))
    return np.vstack(found)


def euler(rotation: Array) -> Array:
    """Return the angles about x, the new y and the new z."""
    return np.array(
        [
            math.atan2(-rotation[1, 2], rotation[2, 2]),
            math.asin(max(-1.0, min(1.0, rotation[0, 2]))),
            math.atan2(-rotation[0, 1], rotation[0, 0]),
        ]
    )


def vector(rotation: Array) -> Array:
    """Return the rotation vector, by the angle and the skew part."""
    angle = math.acos(max(-1.0, min(1.0, 0.5 * (np.trace(rotation) - 1.0))))
    skew = np.array(
        [
            rotation[2, 1] - rotation[1, 2],
            rotation[0, 2] - rotation[2, 0],
            rotation[1, 0] - rotation[0, 1],
        ]
    )
    return skew * (angle / (2.0 * math.sin(angle)) if angle > 1e-9 else 0.5)


DOWN = np.diag([1.0, -1.0, -1.0])  # the hand looks down


def keeps_level(parameterization: int) -> tuple[Constraints, Callable[[Array], float]]:
    """Return that the hand looks down, and by how much a state misses that."""
    turn = OrientationConstraint(link_name=HAND, weight=1.0, parameterization=parameterization)
    turn.header.frame_id = 'panda_link0'
    turn.orientation.x, turn.orientation.w = 1.0, 0.0
    turn.absolute_x_axis_tolerance = turn.absolute_y_axis_tolerance = 0.3
    turn.absolute_z_axis_tolerance = math.pi
    angles = vector if parameterization else euler

    def beyond(positions: Array) -> float:
        turned = angles(DOWN.T @ hand(positions)[:3, :3])
        return float(np.abs(turned[:2]).max()) - 0.3

    return Constraints(orientation_constraints=[turn]), beyond


def stays_above(height: float) -> tuple[Constraints, Callable[[Array], float]]:
    """Return that a point 0.1 m below the flange stays in a box."""
    place = PositionConstraint(link_name=HAND, weight=1.0)
    place.header.frame_id = 'panda_link0'
    place.target_point_offset.z = 0.1
    place.constraint_region.primitives = [
        SolidPrimitive(type=SolidPrimitive.BOX, dimensions=[2.0, 2.0, 0.4])
    ]
    place.constraint_region.primitive_poses = [pose_at(0.0, 0.0, height + 0.2)]

    def beyond(positions: Array) -> float:
        point = hand(positions) @ np.array([0.0, 0.0, 0.1, 1.0])
        return float(max(abs(point[2] - height - 0.2) - 0.2, np.abs(point[:2]).max() - 1.0))

    return Constraints(position_constraints=[place]), beyond


def keeps_a_joint() -> tuple[Constraints, Callable[[Array], float]]:
    """Return that a joint stays between two positions, which are not as far on either side."""
    joint = JointConstraint(
        joint_name='panda_joint4',
        position=-2.2,
        tolerance_above=0.35,
        tolerance_below=0.2,
        weight=1.0,
    )

    def beyond(positions: Array) -> float:
        return float(max(positions[3] + 1.85, -2.4 - positions[3]))

    return Constraints(joint_constraints=[joint]), beyond


CASES = {
    'euler angles': keeps_level(OrientationConstraint.XYZ_EULER_ANGLES),
    'rotation vector': keeps_level(OrientationConstraint.ROTATION_VECTOR),
    'region': stays_above(0.4),
    'joint': keeps_a_joint(),
}


def request(constraints: Constraints, goal: list[float]) -> MotionPlanRequest:
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
    assert service.error_code.val == MoveItErrorCodes.SUCCESS, service.error_code
    _status, action = rig.move(action_goal(request(constraints, GOAL), plan_only=True))
    assert action.error_code.val == MoveItErrorCodes.SUCCESS, action.error_code
    for trajectory in (service.trajectory, action.planned_trajectory):
        path = states(trajectory.joint_trajectory)
        assert max(beyond(each) for each in path) < 1e-6
        assert path[-1] == pytest.approx(GOAL, abs=1e-3)
