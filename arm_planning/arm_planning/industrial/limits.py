# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Limits of the motion of a link, in the words of pilz_cartesian_limits.yaml.

::

    cartesian_limits:
      max_trans_vel: 1.0    # [m/s]
      max_trans_acc: 2.25   # [m/s2]
      max_trans_dec: -5.0   # [m/s2]
      max_rot_vel: 1.57     # [rad/s]

As in Pilz' planner, one profile leads along a path, with ``max_trans_acc`` at both ends;
``max_trans_dec`` is read and checked, and not used. Rotations have the acceleration that takes as
long to their full speed.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields
import math
from typing import Any

from ..exceptions import PlanningCode, PlanningError

MIN_SCALING = 1e-4  # least factor of velocity and acceleration, as in Pilz' planner

JERK_RATIO = 10.0
"""Jerk over acceleration along a path in [1/s]: Pilz' planner has no limit of jerk."""


@dataclass(frozen=True, slots=True)
class CartesianLimits:
    """Limits of a link's motion; the defaults are those of the Panda and the PRBT in MoveIt."""

    max_trans_vel: float = 1.0  # greatest speed in [m/s]
    max_trans_acc: float = 2.25  # greatest acceleration in [m/s2]
    max_trans_dec: float = -5.0  # greatest deceleration in [m/s2], negative
    max_rot_vel: float = 1.57  # greatest speed of rotation in [rad/s]

    def __post_init__(self) -> None:
        """Refuse limits that are none."""
        for field in fields(self):
            value = getattr(self, field.name)
            sign, word = (-1.0, 'negative') if field.name == 'max_trans_dec' else (1.0, 'positive')
            if not math.isfinite(value) or value * sign <= 0.0:
                raise PlanningError(
                    PlanningCode.FAILURE,
                    f'cartesian_limits: {field.name} is {value}, a {word} number is needed',
                )

    @classmethod
    def of_table(cls, table: Mapping[str, Any]) -> CartesianLimits:
        """Return the limits of a table ``cartesian_limits``; other keys are left to others.

        Raises:
            PlanningError: A value is no number of the right sign.
        """
        try:
            values = {
                each.name: float(table[each.name]) for each in fields(cls) if each.name in table
            }
        except (TypeError, ValueError) as error:
            raise PlanningError(PlanningCode.FAILURE, f'cartesian_limits: {error}') from error
        return cls(**values)

    @property
    def radius(self) -> float:
        """Way in [m] that takes as long as a rotation of 1 rad."""
        return self.max_trans_vel / self.max_rot_vel
