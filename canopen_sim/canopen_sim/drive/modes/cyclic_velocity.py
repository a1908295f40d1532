# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Cyclic synchronous velocity mode (CiA 402-2, clause 14)."""

from __future__ import annotations

from arm_canopen import OperationMode

from ..profile import Limits
from .streamed import Streamed
from .velocity_plan import plan_bounded


class CyclicVelocity(Streamed):
    """Ramps from set-point to set-point within a cycle, as far as 0x60C5 and 0x60C6 allow.

    The velocity is 0x60FF plus the velocity offset 0x60B1. The last one holds when the stream
    ends; software position limits stop the axis.
    """

    number = OperationMode.CYCLIC_VELOCITY

    def take(self, period: float, now: float) -> bool:
        """Ramp to the velocity within a period."""
        objects, axis = self.objects, self.axis
        wanted = float(objects.target_velocity.value + objects.velocity_offset.value)
        axis.advance(now)
        change = abs(wanted - axis.demand.velocity)
        bounds = objects.position_limits()
        if not change and axis.arrived:
            return False
        needed = max(change / period, objects.slow_down)
        limits = Limits(
            axis.speed,
            min(needed, objects.max_acceleration.value or needed),
            min(needed, objects.max_deceleration.value or needed),
        )
        motion, bounded = plan_bounded(axis.demand, wanted, limits, bounds, now)
        self.limited = abs(wanted) > axis.speed or (bounded and motion.end <= now)
        axis.follow(motion)
        return True
