# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motion planning of an arm among obstacles; no ROS.

:meth:`Planner.plan` turns a :class:`MotionRequest` into a :class:`MotionPlan`, or raises a
:class:`PlanningError` with MoveIt's error code and the reason in words.

Conventions: joint vectors (n) are in the order of the group's joints, in [rad] (prismatic joints
in [m]); ``positions`` of the whole robot are keyed by joint name. Waypoints of a path are rows
(m, n). Poses are expressed in the root link. Times and durations are in [s]; velocity and
acceleration scaling factors are above 0 and at most 1.
"""

from __future__ import annotations

from .exceptions import ConfigError, PlanningCode, PlanningError
from .pilz_planner import SequenceItem
from .planner import Planner
from .requests import (
    CircPoint,
    CircPointKind,
    Goal,
    JointGoal,
    MotionPlan,
    MotionRequest,
    OrientationConstraint,
    Parameterization,
    PathConstraints,
    PoseGoal,
    PositionConstraint,
)
from .srdf import make_srdf, SrdfDraft
from .srdf import SAMPLES as SRDF_SAMPLES
from .validity import ValidityCheck, Violation

__all__ = [
    'SRDF_SAMPLES',
    'CircPoint',
    'CircPointKind',
    'ConfigError',
    'Goal',
    'JointGoal',
    'MotionPlan',
    'MotionRequest',
    'OrientationConstraint',
    'Parameterization',
    'PathConstraints',
    'Planner',
    'PlanningCode',
    'PlanningError',
    'PoseGoal',
    'PositionConstraint',
    'SequenceItem',
    'SrdfDraft',
    'ValidityCheck',
    'Violation',
    'make_srdf',
]
