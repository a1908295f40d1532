# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Sign, offset and limits of a joint from servo angles that were read in known places."""

from __future__ import annotations

from dataclasses import replace
import math

from ..exceptions import CommandError
from ..joints import JointServo

MIN_TURN = 8.0  # [deg] that distinguishes a direction from a shaking hand
LIMIT_MARGIN = math.radians(2.0)  # [rad] that targets stay away from a stop


def with_zero(servo: JointServo, angle: float) -> JointServo:
    """Return a servo whose joint is at zero where the servo reads an angle [deg]."""
    return replace(servo, offset=-servo.sign * servo.gain * angle)


def with_direction(servo: JointServo, zero: float, turned: float) -> JointServo:
    """Return a servo whose joint went the positive way from one angle to another [deg].

    Raises:
        CommandError: It was turned by less than MIN_TURN.
    """
    if abs(turned - zero) < MIN_TURN:
        raise CommandError(
            f'{servo.joint}: motor {servo.motor} turned by {turned - zero:.1f} degrees; at least '
            f'{MIN_TURN:.0f} are needed. Is this the right joint?'
        )
    sign = 1 if turned > zero else -1
    return with_zero(replace(servo, sign=sign), zero)


def with_limits(servo: JointServo, one: float, other: float) -> JointServo:
    """Return a servo that stays within two ends of its travel [deg], and within its limits so far.

    Raises:
        CommandError: The ends are so close that nothing is left between them.
    """
    low, high = sorted((servo.position(one), servo.position(other)))
    lower = max(low + LIMIT_MARGIN, servo.lower)
    upper = min(high - LIMIT_MARGIN, servo.upper)
    if lower >= upper:
        raise CommandError(
            f'{servo.joint}: nothing is left between {low:.2f} and {high:.2f} rad within its '
            f'limits {servo.lower:.2f} to {servo.upper:.2f}'
        )
    return replace(servo, lower=lower, upper=upper)


def moved_motor(before: dict[int, float], after: dict[int, float]) -> int | None:
    """Return the motor that turned the farthest, None when none turned enough."""
    turns = {motor: abs(after[motor] - before[motor]) for motor in after if motor in before}
    motor = max(turns, key=turns.__getitem__, default=None)
    return motor if motor is not None and turns[motor] >= MIN_TURN else None
