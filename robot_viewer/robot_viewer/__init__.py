# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a viewer needs of a robot: its description, and /tf from its joint positions.

:func:`read_urdf` makes a :class:`RobotModel` of a URDF; :class:`StatePublisher` says which
transforms follow from a JointState, as ROS' robot_state_publisher does; :class:`JointWatch` finds
joints that are missing. None of them knows ROS; the nodes are in :mod:`.nodes`.
"""

from .exceptions import DescriptionError, ViewerError
from .joint_watch import JointWatch
from .state_publisher import FrameTransform, joint_transform, Remark, Settings, StatePublisher
from .transforms import Transform
from .urdf import Joint, JointKind, Mimic, read_urdf, RobotModel

__version__ = '0.1.0'

__all__ = [
    'DescriptionError',
    'FrameTransform',
    'Joint',
    'JointKind',
    'JointWatch',
    'Mimic',
    'Remark',
    'RobotModel',
    'Settings',
    'StatePublisher',
    'Transform',
    'ViewerError',
    'joint_transform',
    'read_urdf',
]
