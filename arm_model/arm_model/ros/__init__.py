# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot model in ROS: built from parameters, with TF frames and scenes from messages."""

from .planning_scene import (
    allowed_collisions,
    apply_planning_scene,
    FrameOf,
    hull_of,
    primitive_shape,
    scene_change,
)
from .robot_parameters import (
    declare_description,
    declare_groups,
    declare_robot,
    Description,
    GroupModels,
    same_robot,
)
from .tf import duration_fields, FrameTree, pose_of, seconds, TfListener, xyz, xyzw

__all__ = [
    'Description',
    'FrameOf',
    'FrameTree',
    'GroupModels',
    'TfListener',
    'allowed_collisions',
    'apply_planning_scene',
    'declare_description',
    'declare_groups',
    'declare_robot',
    'duration_fields',
    'hull_of',
    'pose_of',
    'primitive_shape',
    'same_robot',
    'scene_change',
    'seconds',
    'xyz',
    'xyzw',
]
