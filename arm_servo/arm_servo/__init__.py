# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging, trajectories and single targets of an arm on one jerk-limited motion core."""

from __future__ import annotations

from arm_model import (
    ArmError,
    CommandError,
    JointLimits,
    LimitsError,
    load_limits,
    ModelError,
    Pose,
    RobotModel,
    RobotState,
)

from .bounds import BrakeSettings
from .core import MotionCore
from .core_settings import CoreSettings
from .exceptions import GoalCode, GoalError, NotReadyError
from .execution import Execution, ExecutionSettings, Feedback, Phase
from .goal import GoalPoint, GoalRules, JointTolerance, TrajectoryGoal
from .outcome import Outcome
from .parameter_check import check_parameters
from .report import Cause, Limiter, MotionReport
from .servo import ServoSettings
from .set_point import SetPoint, Source
from .velocity_ik import IkSettings

__all__ = [
    'ArmError',
    'BrakeSettings',
    'Cause',
    'CommandError',
    'CoreSettings',
    'Execution',
    'ExecutionSettings',
    'Feedback',
    'GoalCode',
    'GoalError',
    'GoalPoint',
    'GoalRules',
    'IkSettings',
    'JointLimits',
    'JointTolerance',
    'Limiter',
    'LimitsError',
    'ModelError',
    'MotionCore',
    'MotionReport',
    'NotReadyError',
    'Outcome',
    'Phase',
    'Pose',
    'RobotModel',
    'RobotState',
    'ServoSettings',
    'SetPoint',
    'Source',
    'TrajectoryGoal',
    'check_parameters',
    'load_limits',
]
