# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reads robot descriptions: the kinematic tree of a URDF, the groups of an SRDF.

It needs only the standard library, except for xacro files, so every package can use it: arm
models, publishers of joint states and /tf, bring-ups.
"""

from .exceptions import DescriptionError, MeshFileError, XacroError
from .kinematics import (
    centre_of_mass,
    joint_position,
    joint_transform,
    link_poses,
    parents_first,
)
from .srdf import EndEffector, find_group, Group, JointGroup, Pair, parse_srdf, SemanticDescription
from .transforms import (
    about,
    compose,
    from_rpy,
    multiply,
    NO_ROTATION,
    Quaternion,
    rotate,
    Transform,
    Vector,
)
from .urdf import (
    Joint,
    JointKind,
    JointRange,
    KinematicTree,
    Mimic,
    MOVABLE,
    PointMass,
    read_urdf,
    UrdfShape,
)
from .xacro_files import expand_xacro, find_mesh, find_package, mesh_unit

__all__ = [
    'MOVABLE',
    'NO_ROTATION',
    'DescriptionError',
    'EndEffector',
    'Group',
    'Joint',
    'JointGroup',
    'JointKind',
    'JointRange',
    'KinematicTree',
    'MeshFileError',
    'Mimic',
    'Pair',
    'PointMass',
    'Quaternion',
    'SemanticDescription',
    'Transform',
    'UrdfShape',
    'Vector',
    'XacroError',
    'about',
    'centre_of_mass',
    'compose',
    'expand_xacro',
    'find_group',
    'find_mesh',
    'find_package',
    'from_rpy',
    'joint_position',
    'joint_transform',
    'link_poses',
    'mesh_unit',
    'multiply',
    'parents_first',
    'parse_srdf',
    'read_urdf',
    'rotate',
]
