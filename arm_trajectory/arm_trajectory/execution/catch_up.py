# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Following a moving state: exactly where the limits allow it, catching up where they do not."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from arm_model import JointLimits, RobotState

from ..otg import OnlineTrajectoryGenerator, Plan

INTERCEPTION_CYCLES = (4, 10, 25, 60, 150)  # cycles after which an interception is tried
MAX_ITERATIONS = 3  # how often the time of a later interception is improved

PLAN_TOLERANCE = 1e-7
"""How exactly an interception must still be as planned in [rad], and 100 times in [rad/s]."""

ROUNDING_FACTOR = 1.0 + 1e-6  # rounding of velocities and accelerations that is let pass

JERK_TOLERANCE = 0.1
"""Changes of speed and place in a cycle, beyond those of an even jerk, that still count as even.

As shares of j T^2 and j T^3.
"""

ACCELERATION_TOLERANCE = 0.01  # the same change of place where a path is met, as a share of a T^2

FOLLOWING_JERK_TOLERANCE = (0.25, 0.129)
"""The same where the state that is followed goes on: a limited jerk that turns makes as much."""


class CatchUpInterpolator:
    """Follows a state that moves by itself, within the limits of the joints.

    A step that the limits allow is taken exactly. Otherwise it plans to where the state will be
    when it can be met, and keeps to this plan while the state goes on as foreseen. Planned anew in
    every cycle, the interception would be put off again and again.
    """

    def __init__(self, limits: JointLimits, generator: OnlineTrajectoryGenerator) -> None:
        self._limits = limits
        self._generator = generator
        self._plan: Plan | None = None
        self._elapsed = 0.0
        self._exact = False

    @property
    def exact(self) -> bool:
        """Whether the last step was taken exactly: it is on what is followed."""
        return self._exact

    def step(
        self, state: RobotState, ahead: Callable[[float], RobotState], period: float
    ) -> RobotState | None:
        """Advance by a step.

        Args:
            ahead: The state to follow, by the time from now in [s].

        Returns:
            The state to command next; None when there is no way to meet it.
        """
        wanted = ahead(period)
        if self._allowed(state, wanted, period):
            self._plan, self._exact = None, True
            return wanted
        self._exact = False
        kept = self._kept(state, ahead)
        if kept and self._plan is not None and self._elapsed + period >= self._plan.duration:
            self._plan, kept = None, False  # met within this period
            if self._soft(state, wanted, period):
                return wanted
        if not kept:
            self._plan, self._elapsed = self._interception(state, ahead, period), 0.0
        if self._plan is None:
            return None
        self._elapsed += period
        return self._plan.at(self._elapsed)

    def _kept(self, state: RobotState, ahead: Callable[[float], RobotState]) -> bool:
        """Whether the plan still begins and ends where it should."""
        if self._plan is None:
            return False
        left = self._plan.duration - self._elapsed
        foreseen, now = self._within(ahead(left)), self._plan.at(self._elapsed)
        return _same(now, state) and _same(self._plan.at(self._plan.duration), foreseen)

    def _allowed(self, state: RobotState, wanted: RobotState, period: float) -> bool:
        """Whether a jerk within the limits leads from one state to the other."""
        if not self._soft(state, wanted, period):
            return False
        most = self._limits.jerk * period
        jolt, shift = FOLLOWING_JERK_TOLERANCE if self._exact else (JERK_TOLERANCE, JERK_TOLERANCE)
        mean = 0.5 * (state.acceleration + wanted.acceleration) * period
        if np.any(np.abs(wanted.velocity - state.velocity - mean) > jolt * most * period):
            return False
        bend = (2.0 * state.acceleration + wanted.acceleration) / 6.0 * period
        way = wanted.position - state.position - (state.velocity + bend) * period
        allowed = shift * most * period**2
        if not self._exact:  # seen on the positions it is a change of speed
            allowed = np.minimum(
                allowed, ACCELERATION_TOLERANCE * self._limits.acceleration * period**2
            )
        return bool(np.all(np.abs(way) <= allowed))

    def _soft(self, state: RobotState, wanted: RobotState, period: float) -> bool:
        """Whether a state is within the limits, and its acceleration near the present one."""
        limits = self._limits
        bend = np.abs(wanted.acceleration - state.acceleration)
        return bool(
            np.all(bend <= limits.jerk * period * ROUNDING_FACTOR)
            and np.all(np.abs(wanted.velocity) <= limits.velocity * ROUNDING_FACTOR)
            and np.all(np.abs(wanted.acceleration) <= limits.acceleration * ROUNDING_FACTOR)
        )

    def _interception(
        self, state: RobotState, ahead: Callable[[float], RobotState], period: float
    ) -> Plan | None:
        """Plan to where the state will be when it is met: soon where that can be, else later."""
        for cycles in INTERCEPTION_CYCLES:
            plan = self._planned(state, self._within(ahead(cycles * period)), cycles * period)
            if plan is not None and plan.duration <= cycles * period * (1.0 + 1e-9):
                return plan
        time, best = INTERCEPTION_CYCLES[-1] * period, None
        for _ in range(MAX_ITERATIONS):
            plan = self._planned(state, self._within(ahead(time)), time)
            if plan is None:
                return best
            best = plan
            if plan.duration <= time * (1.0 + 1e-9):
                return best
            time = plan.duration
        return best

    def _planned(self, state: RobotState, target: RobotState, shortest: float) -> Plan | None:
        plan = self._generator.to_state(state, target, shortest)
        if plan is not None:
            return plan
        plan = self._generator.to_state(state, target)  # ruckig may refuse a least duration
        if plan is not None:
            return plan
        even = RobotState(target.position, target.velocity, np.zeros(len(target.velocity)))
        return self._generator.to_state(state, even)

    def _within(self, target: RobotState) -> RobotState:
        """Return a state that can be met: its speed and acceleration within the limits."""
        limits = self._limits
        acceleration = np.clip(target.acceleration, -limits.acceleration, limits.acceleration)
        # a speed that does not overrun its limit before the acceleration is taken back
        coasting = acceleration**2 / (2.0 * limits.jerk)
        most = np.maximum(limits.velocity - coasting, 0.0)
        return RobotState(target.position, np.clip(target.velocity, -most, most), acceleration)


def _same(one: RobotState, other: RobotState) -> bool:
    return bool(
        np.abs(one.position - other.position).max() < PLAN_TOLERANCE
        and np.abs(one.velocity - other.velocity).max() < 100.0 * PLAN_TOLERANCE
    )
