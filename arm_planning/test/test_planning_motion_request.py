# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""MoveIt's requests as requests of the core; test_planning_bad_input has what is refused."""

from __future__ import annotations

from typing import Any

from geometry_msgs.msg import Vector3
from moveit_msgs.msg import (
    Constraints,
    JointConstraint,
    MotionPlanRequest,
    OrientationConstraint,
    PositionConstraint,
)
import numpy as np
from planning_messages import panda, pose_at
import pytest
from shape_msgs.msg import SolidPrimitive

from arm_model import Sphere
from arm_planning import CircPointKind, JointGoal, Parameterization, PoseGoal
from arm_planning.ros.motion_request import RequestReader
from arm_planning.ros.scene_snapshot import SceneSnapshot

MODEL = panda().model('panda_arm')
READY = [0.0, -0.785, 0.0, -2.356, 0.0, 1.571, 0.785]
PLACES = panda().positions(dict(zip(MODEL.joints, READY, strict=True)))
READER = RequestReader(MODEL, SceneSnapshot(panda().scene), PLACES)
TIP = 'panda_link8'


def joint(number: int, position: float, tolerance: float = 0.01) -> JointConstraint:
    """Return the constraint of a joint."""
    return JointConstraint(
        joint_name=f'panda_joint{number}',
        position=position,
        tolerance_above=tolerance,
        tolerance_below=tolerance,
    )


def place(x: float, y: float, z: float, link: str = TIP) -> PositionConstraint:
    """Return the constraint of a link to a sphere of 1 mm."""
    message = PositionConstraint(link_name=link)
    message.header.frame_id = 'panda_link0'
    region = message.constraint_region
    region.primitives = [SolidPrimitive(type=SolidPrimitive.SPHERE, dimensions=[0.001])]
    region.primitive_poses = [pose_at(x, y, z)]
    return message


def turn(link: str = TIP) -> OrientationConstraint:
    """Return the constraint of a link to the axes of the root."""
    message = OrientationConstraint(link_name=link)
    message.header.frame_id = 'panda_link0'
    message.absolute_x_axis_tolerance = message.absolute_y_axis_tolerance = 0.01
    message.absolute_z_axis_tolerance = 0.02
    return message


def request(**fields: Any) -> MotionPlanRequest:
    """Return a request with a goal."""
    goal = Constraints(joint_constraints=[joint(1, 0.5)])
    return MotionPlanRequest(**{'goal_constraints': [goal], **fields})


def test_joints_that_a_goal_leaves_out_stay() -> None:
    """The others are where they are wanted, with the tolerance on the nearer side."""
    message = joint(1, 0.5)
    message.tolerance_above = 0.3
    goal = READER.goal(Constraints(joint_constraints=[message]))
    assert isinstance(goal, JointGoal)
    assert list(goal.positions) == pytest.approx([0.5, *READY[1:]])
    assert goal.tolerance[0] == pytest.approx(0.01)


def test_a_pose_is_that_of_the_link() -> None:
    """Position, orientation and tolerances; a point beside the link moves it the other way."""
    wanted = place(0.4, 0.1, 0.5)
    wanted.target_point_offset = Vector3(z=0.1)
    goal = READER.goal(
        Constraints(position_constraints=[wanted], orientation_constraints=[turn()])
    )
    assert isinstance(goal, PoseGoal)
    assert goal.link == TIP
    assert goal.pose.position == pytest.approx([0.4, 0.1, 0.4])
    assert goal.tolerances is not None
    (point,), (turned,) = goal.tolerances.positions, goal.tolerances.orientations
    assert point.regions[0].shape == Sphere(0.001)
    assert point.offset == pytest.approx([0.0, 0.0, 0.1])
    assert list(turned.tolerance) == [0.01, 0.01, 0.02]
    assert turned.parameterization is Parameterization.XYZ_EULER_ANGLES


def test_unset_fields_have_the_defaults_of_moveit() -> None:
    """0 is a scaling factor that was not given."""
    read = READER.request(request())
    assert (read.velocity_scaling, read.acceleration_scaling) == (1.0, 1.0)
    assert (read.timeout, read.attempts, read.constraints) == (5.0, 1, None)
    pilz = request(pipeline_id='pilz_industrial_motion_planner')
    assert READER.request(pilz).planner_id == 'PTP'


def test_the_point_of_a_circle_is_a_path_constraint() -> None:
    """As Pilz' planner has it."""
    constraints = Constraints(name='interim', position_constraints=[place(0.4, 0.1, 0.5)])
    read = READER.request(request(path_constraints=constraints))
    assert read.via is not None
    assert read.via.kind is CircPointKind.INTERIM
    assert read.via.position == pytest.approx([0.4, 0.1, 0.5])
    assert read.constraints is None


def test_path_constraints_hold_on_the_path() -> None:
    """Joint ranges, rotations and regions."""
    constraints = Constraints(
        joint_constraints=[joint(2, 0.1, 0.2)],
        position_constraints=[place(0.4, 0.1, 0.5)],
        orientation_constraints=[turn()],
    )
    read = READER.constraints(constraints)
    assert read is not None
    assert read.joints['panda_joint2'] == pytest.approx((-0.1, 0.3))
    assert np.allclose(read.orientations[0].rotation, np.eye(3))
    assert read.positions[0].regions[0].pose.position == pytest.approx([0.4, 0.1, 0.5])
