# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A single target: the quickest way to a place, at any speed."""

from __future__ import annotations

import math

import numpy as np

from .arrays import Array
from .limits import JointLimits
from .otg import Generator, MotionState

ARRIVED = 1e-6
"""How near to the target the set-points must be to have arrived in [rad]."""

SLOWEST = 0.01
"""Least share of the speed that a target is approached with."""


class SingleTarget:
    """Plans to one target, anew in every cycle.

    Attributes:
        target: Positions in [rad]; None without one.
        max_speed: Greatest speed of a joint on the way there in [rad/s].
    """

    def __init__(self, limits: JointLimits, generator: Generator) -> None:
        """Wait for a target.

        Args:
            limits: Limits of the joints.
            generator: Plans at full speed.
        """
        self._limits = limits
        self._full = self._planner = generator
        self._planned_for = (1.0, math.inf)
        self.target: Array | None = None
        self.max_speed = math.inf

    def step(self, state: MotionState, speed_scaling: float, period: float) -> MotionState | None:
        """Return the next state; None to come to rest.

        Args:
            state: Commanded state of the joints.
            speed_scaling: Share of the speed, 0 to 1.
            period: Time to the next step in [s].
        """
        if self.target is None or speed_scaling == 0.0:
            return None
        if (speed_scaling, self.max_speed) != self._planned_for:
            self._planned_for = speed_scaling, self.max_speed
            self._planner = self._full.slowed(max(speed_scaling, SLOWEST), self.max_speed)
        there = MotionState.at_rest(self.target)
        plan = self._planner.to_state(state, there)
        if plan is None:
            return None
        return there if plan.duration <= period else plan.at(period)

    def reached(self, state: MotionState) -> bool:
        """Whether a state rests at the target."""
        return (
            self.target is not None
            and not state.moving
            and bool(np.allclose(state.position, self.target, atol=ARRIVED))
        )
