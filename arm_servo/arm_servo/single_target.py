# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A single target: the quickest way to a place, at any speed."""

from __future__ import annotations

import math

import numpy as np

from .arrays import Array
from .exceptions import CommandError
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
        fastest: Greatest speed of a joint on the way there in [rad/s].
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
        self.fastest = math.inf

    def check(self, target: Array) -> None:
        """Make sure that a target is within the limits.

        Args:
            target: Positions in [rad].

        Raises:
            CommandError: A position is beyond a limit.
        """
        beyond = (target < self._limits.lower) | (target > self._limits.upper)
        if beyond.any():
            joint = int(np.argmax(beyond))
            raise CommandError(
                f'{self._limits.names[joint]}: {target[joint]:.4f} is beyond its limits'
                f' {self._limits.lower[joint]:.4f}..{self._limits.upper[joint]:.4f}'
            )

    def step(self, state: MotionState, speed: float, period: float) -> MotionState | None:
        """Return the next state; None to come to rest.

        Args:
            state: Commanded state of the joints.
            speed: Share of the speed, 0 to 1.
            period: Time to the next step in [s].
        """
        if self.target is None or speed == 0.0:
            return None
        if (speed, self.fastest) != self._planned_for:
            self._planned_for = speed, self.fastest
            self._planner = self._full.slowed(max(speed, SLOWEST), self.fastest)
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
