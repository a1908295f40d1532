# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging, trajectories and single targets of an arm on one jerk-limited motion core.

Conventions: joint vectors are in the order of the arm's joints in [rad], or for prismatic joints
[m]; velocities and accelerations in these units per [s] and [s2]. Twists (6) are linear before
angular; scaled twists divide lengths by the arm's reach. ``now``, ``begin`` and ``time`` are on
the steady clock in [s], ``period`` is the time to the next cycle in [s]. ``state`` is the last
commanded state, ``measured`` the state that the drives report. A ``reason`` states what happened
and the remedy; it becomes the outcome of the motion that it ends.
"""

from __future__ import annotations

from .controllers.controller import (
    ArmState,
    Cause,
    Controller,
    Limiter,
    MotionReport,
    NotReadyError,
    Outcome,
    SetPoint,
    Source,
)
from .controllers.jog import JointCommand, PoseCommand, ServoSettings, TwistCommand
from .controllers.trajectory import Execution, ExecutionSettings, Feedback, Phase
from .controllers.velocity_ik import IkSettings, VelocityBoundsSettings
from .core.motion_core import check_arm, MotionCore
from .core.preparation import CoreSettings
from .core.requests import (
    DisplacementRequest,
    JogRequest,
    PauseRequest,
    SpeedRequest,
    StopRequest,
    TargetRequest,
)
from .ros.parameter_check import check_parameters

__all__ = [
    'ArmState',
    'Cause',
    'Controller',
    'CoreSettings',
    'DisplacementRequest',
    'Execution',
    'ExecutionSettings',
    'Feedback',
    'IkSettings',
    'JogRequest',
    'JointCommand',
    'Limiter',
    'MotionCore',
    'MotionReport',
    'NotReadyError',
    'Outcome',
    'PauseRequest',
    'Phase',
    'PoseCommand',
    'ServoSettings',
    'SetPoint',
    'Source',
    'SpeedRequest',
    'StopRequest',
    'TargetRequest',
    'TwistCommand',
    'VelocityBoundsSettings',
    'check_arm',
    'check_parameters',
]
