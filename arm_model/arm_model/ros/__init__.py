# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot model in ROS: from parameters, and its frames beside those of TF."""

from .numbers import duration_fields, seconds, xyz, xyzw
from .robot_parameters import declare_groups, declare_robot, GroupModels, same_robot
from .tf_listener import TfListener

__all__ = [
    'GroupModels',
    'TfListener',
    'declare_groups',
    'declare_robot',
    'duration_fields',
    'same_robot',
    'seconds',
    'xyz',
    'xyzw',
]
