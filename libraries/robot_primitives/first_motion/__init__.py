# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The first motion of a joint: guarded while it moves, then judged by what a person has seen.

`guard` decides, `judgement` concludes, `correction` and `bus_edit` correct: without a
clock or bus.
"""

from .bus_edit import BusEditError, edited, replace_file, yaml_text
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
)

__all__ = [
    'CAUSES',
    'FASTEST',
    'FOLLOWING',
    'FURTHEST',
    'AxisScales',
    'BusEditError',
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
    'edited',
    'judge',
    'propose',
    'replace_file',
    'too_far',
    'too_fast',
    'too_few_increments',
    'yaml_text',
]
