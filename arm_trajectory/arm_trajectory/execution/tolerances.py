# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How far a joint may be off a trajectory, and what is said when it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math

import numpy as np

from arm_model import Array, JointLimits

from ..exceptions import GoalCode, GoalError
from ..goal import JointTolerance


@dataclass(frozen=True, slots=True, eq=False)
class Tolerances:
    """Tolerances of every joint; infinite where there are none."""

    position: Array  # in [rad]
    velocity: Array  # in [rad/s]

    def violation(self, limits: JointLimits, position: Array, velocity: Array) -> str | None:
        """Return what is off by more than its tolerance, in words.

        Args:
            position: Errors of position in [rad].
        """
        for error, tolerance, what, unit in (
            (position, self.position, 'position', 'rad'),
            (velocity, self.velocity, 'velocity', 'rad/s'),
        ):
            excess = np.abs(error) / tolerance
            joint = int(np.argmax(excess))
            if excess[joint] > 1.0:
                off, most = _distinct(float(error[joint]), float(tolerance[joint]))
                return f'{limits.names[joint]}: {what} off by {off} {unit}, tolerance {most}'
        return None


def _distinct(error: float, tolerance: float) -> tuple[str, str]:
    """Return an error and the tolerance that it exceeds, with digits that show that."""
    for digits in range(4, 12):
        off, most = f'{error:+.{digits}f}', f'{tolerance:.{digits}f}'
        if abs(float(off)) > float(most) > 0.0:
            break
    return off, most


def merge_tolerances(
    limits: JointLimits, given: Mapping[str, JointTolerance] | None, default: JointTolerance
) -> Tolerances:
    """Put tolerances together: those of a goal, else the default.

    Args:
        given: The goal's tolerances by joint: above 0 counts, 0 keeps the default, below takes it
            away.
        default: The default of each joint; 0 is none.

    Raises:
        GoalError: A joint is unknown, or a tolerance is not a number.
    """
    for name, asked in (given or {}).items():
        if name not in limits.names:
            known = ', '.join(limits.names)
            raise GoalError(
                GoalCode.INVALID_JOINTS, f'tolerance of {name!r}: no such joint; joints: {known}'
            )
        if math.isnan(asked.position) or math.isnan(asked.velocity):
            raise GoalError(GoalCode.INVALID_GOAL, f'tolerance of {name}: it is not a number')
    rows = [
        (_one(asked.position, default.position), _one(asked.velocity, default.velocity))
        for asked in ((given or {}).get(name, JointTolerance()) for name in limits.names)
    ]
    return Tolerances(np.array([row[0] for row in rows]), np.array([row[1] for row in rows]))


def _one(asked: float, default: float) -> float:
    value = default if asked == 0.0 else asked
    return value if value > 0.0 else np.inf
