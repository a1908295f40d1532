# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot model in ROS: from parameters, its frames beside those of TF, scenes of messages."""

from .numbers import duration_fields, seconds, xyz, xyzw
from .planning_scene import (
    allowed_collisions,
    apply_attached_object,
    apply_collision_object,
    apply_planning_scene,
    FrameOf,
    hull_of,
    primitive_shape,
)
from .robot_parameters import (
    declare_description,
    declare_groups,
    declare_robot,
    Description,
    GroupModels,
    same_robot,
)
from .tf_listener import learn_static, learn_transforms, STATIC_QOS, TfListener

__all__ = [
    'STATIC_QOS',
    'Description',
    'FrameOf',
    'GroupModels',
    'TfListener',
    'allowed_collisions',
    'apply_attached_object',
    'apply_collision_object',
    'apply_planning_scene',
    'declare_description',
    'declare_groups',
    'declare_robot',
    'duration_fields',
    'hull_of',
    'learn_static',
    'learn_transforms',
    'primitive_shape',
    'same_robot',
    'seconds',
    'xyz',
    'xyzw',
]
