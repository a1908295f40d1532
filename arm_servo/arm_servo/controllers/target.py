# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A single target: the quickest way to a place, at any speed."""

from __future__ import annotations

import numpy as np

from arm_model import Array, frozen, RobotState
from arm_trajectory import GoalCode, OnlineTrajectoryGenerator, Plan

from .controller import ArmState, Controller, Outcome, Source

ARRIVAL_TOLERANCE = 1e-6  # how near to the target the set-points must be to have arrived in [rad]
MIN_SPEED_FACTOR = 0.01  # least share of the speed that a target is approached with


class SingleTarget(Controller):
    """Plans to one target, anew in every cycle."""

    source = Source.TARGET

    def __init__(
        self, target: Array, max_speed: float, generator: OnlineTrajectoryGenerator
    ) -> None:
        """Aim.

        Args:
            max_speed: Greatest speed of a joint on the way there in [rad/s].
        """
        self.target = frozen(target)
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

    def update(self, arm: ArmState, period: float) -> RobotState | None:
        """Return the next state; None to come to rest."""
        state = arm.commanded
        if arm.is_held or arm.speed_scaling == 0.0:
            return None
        plan = self.plan(state, arm.speed_scaling)
        if plan is None:
            if not state.moving:
                self.end(Outcome(GoalCode.INVALID_GOAL, 'no motion leads to the target'))
            return None
        return RobotState.at_rest(self.target) if plan.duration <= period else plan.at(period)

    def conclude(self, arm: ArmState, state: RobotState) -> bool:
        """Return whether it is over: it ends where the arm rests at the target."""
        if not state.moving and np.allclose(state.position, self.target, atol=ARRIVAL_TOLERANCE):
            self.end(Outcome(GoalCode.SUCCESSFUL, 'the target is reached'))
        return super().conclude(arm, state)
