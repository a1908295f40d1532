# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The keys of bus.yml that correct the sign and the scale of an axis, after a judgement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
import math

from .judgement import Cause, Judgement, Verdict

SAME = 1e-6  # share by which two scales may differ and still be the same


@dataclass(frozen=True, slots=True)
class AxisScales:
    """How an axis counts: keys of bus.yml by their names, with the values that the master uses."""

    scale_from_factor_group: bool  # the drive says how it counts (0x608F, 0x6091, 0x6092, 0x6096)
    scale_pos_to_dev: float  # increments per [rad] or [m]
    scale_pos_from_dev: float  # [rad] or [m] per increment
    scale_vel_to_dev: float  # velocity units of the drive per [rad/s] or [m/s]
    scale_vel_from_dev: float  # [rad/s] or [m/s] per velocity unit of the drive
    scale_eff_to_dev: float  # torque units of the drive per unit of effort
    scale_eff_from_dev: float  # units of effort per torque unit of the drive
    offset_pos_from_dev: float  # added to a position after scaling, in [rad] or [m]

    @classmethod
    def of(cls, source: object) -> AxisScales:
        """Copy them from an object with attributes of these names."""
        return cls(**{each.name: getattr(source, each.name) for each in fields(cls)})


def corrected(axis: AxisScales, sign: int, factor: float) -> dict[str, float | bool]:
    """Return the keys to change with their new values, in the order of the file.

    The sign is -1 to turn the direction, and the factor the way of the joint over what the drive
    reported, without the sign.
    """
    change = sign / factor
    to_dev = axis.scale_pos_to_dev * change
    # a velocity in increments per second is wrong by the same factor; in rpm, by none that we know
    in_increments = math.isclose(
        abs(axis.scale_vel_to_dev), abs(axis.scale_pos_to_dev), rel_tol=SAME
    )
    velocity = axis.scale_vel_to_dev * (change if in_increments else sign)
    values: dict[str, float | bool] = {}
    if axis.scale_from_factor_group:
        values['scale_from_factor_group'] = False
    values |= {
        'scale_pos_to_dev': to_dev,
        'scale_pos_from_dev': 1.0 / to_dev,
        'scale_vel_to_dev': velocity,
        'scale_vel_from_dev': 1.0 / velocity,
    }
    effort = math.copysign(axis.scale_eff_to_dev, to_dev)  # torque turns with the position
    if sign < 0 and effort != axis.scale_eff_to_dev:
        values |= {
            'scale_eff_to_dev': effort,
            'scale_eff_from_dev': math.copysign(axis.scale_eff_from_dev, to_dev),
        }
    if axis.offset_pos_from_dev:  # the place of the zero stays
        values['offset_pos_from_dev'] = axis.offset_pos_from_dev / change
    return {name: _rounded(value) for name, value in values.items()}


def _rounded(value: float | bool) -> float | bool:
    """Drop what double precision has added, as 1.0000000000000002."""
    return value if isinstance(value, bool) else float(f'{value:.12g}')


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
