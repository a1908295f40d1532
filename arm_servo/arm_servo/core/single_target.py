# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A single target: the quickest way to a place, at any speed."""

from __future__ import annotations

import numpy as np

from arm_model import Array, frozen, RobotState
from arm_trajectory import GoalCode, OnlineTrajectoryGenerator, Plan

from .outcome import Outcome

ARRIVAL_TOLERANCE = 1e-6  # how near to the target the set-points must be to have arrived in [rad]
MIN_SPEED_FACTOR = 0.01  # least share of the speed that a target is approached with


class SingleTarget:
    """Plans to one target, anew in every cycle.

    Attributes:
        outcome: How it ended; None while it goes on.
    """

    def __init__(
        self, target: Array, max_speed: float, generator: OnlineTrajectoryGenerator
    ) -> None:
        """Aim.

        Args:
            max_speed: Greatest speed of a joint on the way there in [rad/s].
        """
        self.target = frozen(target)
        self.outcome: Outcome | None = None
        self._max_speed, self._generator = max_speed, generator
        self._planned_for, self._planner = 0.0, generator

    def plan(self, state: RobotState, speed_scaling: float) -> Plan | None:
        """Return the way to the target as it is driven; None where there is none.

        Args:
            speed_scaling: Share of the speed, 0 to 1.
        """
        speed_scaling = max(speed_scaling, MIN_SPEED_FACTOR)
        if speed_scaling != self._planned_for:
            self._planned_for = speed_scaling
            self._planner = OnlineTrajectoryGenerator(
                self._generator.limits.scaled(speed_scaling, fastest=self._max_speed)
            )
        return self._planner.to_state(state, RobotState.at_rest(self.target))

    def step(self, state: RobotState, speed_scaling: float, period: float) -> RobotState | None:
        """Return the next state; None to come to rest.

        Args:
            speed_scaling: Share of the speed, 0 to 1.
        """
        if speed_scaling == 0.0:
            return None
        plan = self.plan(state, speed_scaling)
        if plan is None:
            if not state.moving:
                self.end(Outcome(GoalCode.INVALID_GOAL, 'no motion leads to the target'))
            return None
        return RobotState.at_rest(self.target) if plan.duration <= period else plan.at(period)

    def arrive(self, state: RobotState) -> None:
        """End where a state rests at the target."""
        if not state.moving and np.allclose(state.position, self.target, atol=ARRIVAL_TOLERANCE):
            self.end(Outcome(GoalCode.SUCCESSFUL, 'the target is reached'))

    def end(self, outcome: Outcome) -> None:
        """End, unless it has ended."""
        self.outcome = self.outcome or outcome
