# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""First motion of a joint: guarded while it moves, then judged by what a person observed.

`guard` supervises the motion, `judgement` derives corrections; neither has a clock or bus.
"""

from .guard import FOLLOWING, MotionGuard, MotionPlan, Order, Outcome, Sample
from .judgement import (
    AxisScales,
    Cause,
    CAUSES,
    corrected,
    Correction,
    DriveFacts,
    FASTEST,
    FURTHEST,
    JointKind,
    judge,
    Judgement,
    propose,
    Seen,
    too_far,
    too_fast,
    too_few_increments,
    Verdict,
    yaml_text,
)

__all__ = [
    'CAUSES',
    'FASTEST',
    'FOLLOWING',
    'FURTHEST',
    'AxisScales',
    'Cause',
    'Correction',
    'DriveFacts',
    'JointKind',
    'Judgement',
    'MotionGuard',
    'MotionPlan',
    'Order',
    'Outcome',
    'Sample',
    'Seen',
    'Verdict',
    'corrected',
    'judge',
    'propose',
    'too_far',
    'too_fast',
    'too_few_increments',
    'yaml_text',
]
