# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Motion planning of an arm among obstacles; no ROS.

A :class:`Planner` plans: a :class:`MotionRequest` goes in, a :class:`MotionPlan` comes out, or a
:class:`PlanningError` with MoveIt's code and the reason in words.

Conventions: joint vectors (n) are in the order of the group's joints in [rad], of joints that
slide in [m]; where all joints of the robot are meant, ``positions`` are by name. Places on a path
are rows (m, n). Poses are in the root link. Times and durations are in [s], factors of velocity
and acceleration above 0 and at most 1.
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
