# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Robot arms as values: description, limits, kinematics, shapes and their distances; no ROS.

A :class:`RobotModel` is made of URDF, SRDF and limits; a :class:`RobotState` says how its joints
move; a :class:`PlanningScene` holds what may collide, :class:`Clearances` measures it.
:mod:`arm_model.ros` brings a model from parameters, and frames of TF.
"""

from __future__ import annotations

from .arrays import Array, checked, frozen, Mask, Native, Places
from .clearances import Clearances, LeastClearance, Proximity
from .exceptions import ArmError, CommandError, LimitsError, ModelError
from .frame_tree import FrameTree
from .limits import JointLimits, load_limits
from .model import RobotModel
from .names import ArmNames, names_of
from .pose import combined, inverse, Pose, rotation_of, turned_twists
from .scene import PlanningScene
from .state import RobotState

__all__ = [
    'ArmError',
    'ArmNames',
    'Array',
    'Clearances',
    'CommandError',
    'FrameTree',
    'JointLimits',
    'LeastClearance',
    'LimitsError',
    'Mask',
    'ModelError',
    'Native',
    'Places',
    'PlanningScene',
    'Pose',
    'Proximity',
    'RobotModel',
    'RobotState',
    'checked',
    'combined',
    'frozen',
    'inverse',
    'load_limits',
    'names_of',
    'rotation_of',
    'turned_twists',
]
