# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Ramps to a velocity that end at the software position limits."""

from __future__ import annotations

import math
from typing import NamedTuple

from ..profile import Limits, Motion, plan_move, plan_velocity, Point


class BoundedMotion(NamedTuple):
    """A ramp to a velocity.

    Attributes:
        motion: The demand.
        bounded: It ends at a software position limit.
    """

    motion: Motion
    bounded: bool


def plan_bounded(
    start: Point, target: float, limits: Limits, bounds: tuple[float, float], now: float
) -> BoundedMotion:
    """Ramp to a velocity, and stop in time where a position limit lies ahead.

    Args:
        start: Present demand.
        target: Velocity to reach in [inc/s].
        limits: Highest speed of all, and both ramps.
        bounds: Lowest and highest position in [inc], infinite for none.
        now: Start time in [s].
    """
    limit = bounds[target > 0.0]
    if target == 0.0 or math.isinf(limit):
        return BoundedMotion(plan_velocity(start, target, limits, now), bounded=False)
    # a move to the limit is the same ramp, and brakes in time
    within = Limits(min(abs(target), limits.velocity), limits.acceleration, limits.deceleration)
    stopping = plan_velocity(start, 0.0, within, now)
    stop = stopping.at(stopping.end).position
    if (limit - stop) * target <= 0.0:
        return BoundedMotion(stopping, bounded=True)
    return BoundedMotion(plan_move(start, limit, within, now), bounded=True)
