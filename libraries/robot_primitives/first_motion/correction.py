# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a bus.yml has to say instead, after a judgement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math

from .judgement import Cause, Judgement, Verdict
from .scales import AxisScales, corrected

LIMITS = 'limits 0x607D are in increments: those that were computed with the old scale are wrong'
ACCELERATIONS = 'scale_acc_to_dev, where it is written, changes by the factor of scale_vel_to_dev'
VELOCITIES = 'scale_vel_to_dev is in other units than increments per second: check it, too'


@dataclass(frozen=True, slots=True)
class Correction:
    """Keys of a device to change."""

    values: Mapping[str, float | bool]  # new values by key
    before: Mapping[str, float | bool]  # the values that count now, by key
    reason: str  # why, in a line
    notes: tuple[str, ...]  # what else to look at


def propose(scales: AxisScales, judgement: Judgement, cause: Cause | None) -> Correction:
    """Return the correction of a sign or scale; cause None takes it by what was seen by eye."""
    turned = 'the sign was wrong'
    if judgement.verdict is Verdict.WRONG_SIGN:
        factor, why = 1.0, turned
    else:
        sign = f'{turned}, and ' if judgement.sign < 0 else ''
        factor = judgement.measured if cause is None else cause.factor
        what = f'the scale by {factor:.4g}, by eye' if cause is None else cause.text
        why = f'{sign}{what}'
    values = corrected(scales, judgement.sign, factor)
    accelerations = (ACCELERATIONS,) if factor != 1.0 else ()
    same_units = math.isclose(abs(scales.scale_vel_to_dev), abs(scales.scale_pos_to_dev))
    odd_velocity = not same_units and factor != 1.0
    return Correction(
        values,
        {key: getattr(scales, key) for key in values},
        f'first motion: {why}; scale_pos_to_dev was {scales.scale_pos_to_dev!r}',
        (*((VELOCITIES,) if odd_velocity else ()), *accelerations, LIMITS),
    )
