# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Robot descriptions as plain values: the kinematic tree of a URDF, the groups of an SRDF.

The standard library is enough for it, so that every package can read a description here: the
model of an arm, publishers of joint states and of /tf, bring-ups.
"""

from .exceptions import DescriptionError
from .groups import find_group, JointGroup
from .srdf import EndEffector, Group, Pair, parse_srdf, SemanticDescription
from .transforms import about, from_rpy, multiply, Quaternion, rotate, Transform, Vector
from .urdf import Collision, Joint, JointKind, JointRange, KinematicTree, Mimic, MOVABLE, read_urdf

__all__ = [
    'MOVABLE',
    'Collision',
    'DescriptionError',
    'EndEffector',
    'Group',
    'Joint',
    'JointGroup',
    'JointKind',
    'JointRange',
    'KinematicTree',
    'Mimic',
    'Pair',
    'Quaternion',
    'SemanticDescription',
    'Transform',
    'Vector',
    'about',
    'find_group',
    'from_rpy',
    'multiply',
    'parse_srdf',
    'read_urdf',
    'rotate',
]
