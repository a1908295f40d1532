# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The XGO quadruped: parametric URDF, limits, poses, leg kinematics; without rclpy.

Forward and inverse kinematics::

    from quad_description import Pose, pose_positions, quadruped, robot_urdf

    robot = quadruped(robot_urdf('lite'))
    feet = robot.feet(list(pose_positions(Pose.STAND).values()))
    solutions = robot.solve(feet)

Conventions: joint vectors are in the order of the URDF's movable joints in [rad]; points are in
base_link in [m], x ahead, y left, z up; quaternions are x, y, z, w.

Public, besides the names below: the module :mod:`.rotations`.
"""

from urdf_reader import DescriptionError

from .kinematics import (
    body_link,
    FEET,
    Feet,
    foot_link,
    foot_position,
    FootPose,
    jacobian,
    LegGeometry,
    LegSolution,
    Quadruped,
    quadruped,
    raised_feet,
    solve,
    Targets,
)
from .presets import (
    Joint,
    JointLimits,
    LEGS,
    movable_joints,
    Pose,
    pose_positions,
    preset_of,
    PresetError,
    PRESETS,
    robot_urdf,
    run_command,
    STREAM_TIMEOUT,
)
from .state import (
    Backend,
    EMPTY_BATTERY,
    ImuSample,
    JointSample,
    LOW_BATTERY,
    MAX_TILT,
    OdometryState,
    RobotState,
)

__all__ = [
    'EMPTY_BATTERY',
    'FEET',
    'LEGS',
    'LOW_BATTERY',
    'MAX_TILT',
    'PRESETS',
    'STREAM_TIMEOUT',
    'Backend',
    'DescriptionError',
    'Feet',
    'FootPose',
    'ImuSample',
    'Joint',
    'JointLimits',
    'JointSample',
    'LegGeometry',
    'LegSolution',
    'OdometryState',
    'Pose',
    'PresetError',
    'Quadruped',
    'RobotState',
    'Targets',
    'body_link',
    'foot_link',
    'foot_position',
    'jacobian',
    'movable_joints',
    'pose_positions',
    'preset_of',
    'quadruped',
    'raised_feet',
    'robot_urdf',
    'run_command',
    'solve',
]
