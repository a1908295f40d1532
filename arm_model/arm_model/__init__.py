# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Model of a robot arm: limits, kinematics, collision geometry and distances; no ROS.

A :class:`RobotModel` is built from URDF, SRDF and limits; a :class:`RobotState` holds the motion
of its joints; a :class:`PlanningScene` holds collision objects, :class:`Clearances` measures
distances. :mod:`arm_model.ros` builds a model from parameters, and looks up TF frames.

Conventions: joint vectors (n) are in the order of the group's joints, in [rad] (prismatic joints
in [m]); velocities, accelerations and jerks per [s], [s2] and [s3]. Poses of a :class:`RobotModel`
are in its base link, those of a scene in the root link. Quaternions are x, y, z, w; twists are
linear before angular. ``now`` and all times are on the steady clock in [s]. ``folder`` is that of
the URDF; relative names of mesh files start there.
"""

from __future__ import annotations

import os

# before numpy: a second thread of BLAS only spins at the import, and what is here is small
os.environ.setdefault('OPENBLAS_NUM_THREADS', '1')

from .arrays import (
    Array,
    checked,
    combined,
    frozen,
    inverse,
    Mask,
    Native,
    ORIGIN,
    Places,
    Pose,
    RobotState,
    rotation_of,
    turned_twists,
)
from .exceptions import (
    ArmError,
    CommandError,
    LimitsError,
    LinkNameError,
    ModelError,
    ObjectNameError,
    SceneError,
)
from .kinematics import Kinematics
from .limits import JointLimits, load_limits, merge_limits
from .model import ArmFiles, ArmNames, example_files, names_of, RobotModel
from .scene.clearances import Clearances, Contact, LeastClearance, Proximity
from .scene.compiled import compiled_scene, CompiledScene, CompiledSearch
from .scene.links import LinkPairs, sample_link_pairs, with_default_collisions
from .scene.objects import (
    AllowedCollisionMatrix,
    AttachedBody,
    Box,
    Capsule,
    Cells,
    CollisionObject,
    Cone,
    Cylinder,
    Mesh,
    PlacedShape,
    Plane,
    Shape,
    Sphere,
)
from .scene.octomap import OCTOMAP_NAME, octomap_shapes
from .scene.planning_scene import PlanningScene
from .start_poses import pose_quality, start_pose

__all__ = [
    'OCTOMAP_NAME',
    'ORIGIN',
    'AllowedCollisionMatrix',
    'ArmError',
    'ArmFiles',
    'ArmNames',
    'Array',
    'AttachedBody',
    'Box',
    'Capsule',
    'Cells',
    'Clearances',
    'CollisionObject',
    'CommandError',
    'CompiledScene',
    'CompiledSearch',
    'Cone',
    'Contact',
    'Cylinder',
    'JointLimits',
    'Kinematics',
    'LeastClearance',
    'LimitsError',
    'LinkNameError',
    'LinkPairs',
    'Mask',
    'Mesh',
    'ModelError',
    'Native',
    'ObjectNameError',
    'PlacedShape',
    'Places',
    'Plane',
    'PlanningScene',
    'Pose',
    'Proximity',
    'RobotModel',
    'RobotState',
    'SceneError',
    'Shape',
    'Sphere',
    'checked',
    'combined',
    'compiled_scene',
    'example_files',
    'frozen',
    'inverse',
    'load_limits',
    'merge_limits',
    'names_of',
    'octomap_shapes',
    'pose_quality',
    'rotation_of',
    'sample_link_pairs',
    'start_pose',
    'turned_twists',
    'with_default_collisions',
]
