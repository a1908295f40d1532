# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Jogging, trajectories and single targets of an arm on one jerk-limited motion core."""

from __future__ import annotations

from .bounds import BrakeSettings
from .core import MotionCore
from .core_settings import CoreSettings
from .exceptions import NotReadyError
from .execution import Execution, ExecutionSettings, Feedback, Phase
from .outcome import Outcome
from .parameter_check import check_parameters
from .report import Cause, Limiter, MotionReport
from .servo import ServoSettings
from .set_point import SetPoint, Source
from .velocity_ik import IkSettings

__all__ = [
    'BrakeSettings',
    'Cause',
    'CoreSettings',
    'Execution',
    'ExecutionSettings',
    'Feedback',
    'IkSettings',
    'Limiter',
    'MotionCore',
    'MotionReport',
    'NotReadyError',
    'Outcome',
    'Phase',
    'ServoSettings',
    'SetPoint',
    'Source',
    'check_parameters',
]
