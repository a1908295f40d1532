# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Execution of a trajectory: speed scaling, and catching up by an arm that is off the path.

Speed override, pause, resume and cancel change the speed scaling, with limited joint acceleration
and jerk; the path stays the same. Before a path begins, :mod:`.time_scaling` makes it
feasible.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import ruckig

from arm_model import JointLimits, RobotState

from .otg import OnlineTrajectoryGenerator, Plan
from .path import Path

MAX_SCALING_RATE = 10.0
"""Greatest rate of the speed scaling in [1/s]; applies where the joint limits allow more."""

MAX_SCALING_ACCELERATION = 200.0  # greatest change of this rate in [1/s2]

ACCELERATION_FACTOR = 0.9
"""Share of the joint acceleration limits that the path and a scaling change may use together."""

JERK_FACTOR = 0.4  # share of the joint jerk limits that a change of the speed scaling may use
MIN_BUILD_UP_CYCLES = 5.0  # least cycles in which a change of the speed scaling builds up

MIN_ROOM_FACTOR = 0.2
"""Least share of the joint limits for a change of the speed scaling, if the path uses them up."""

JERK_LOOKAHEAD = 0.01  # path time over which the path's own jerk is estimated in [s]
FORESIGHT_STEP = 0.01  # time step for predicting the speed scaling in [s]


class TimerState(NamedTuple):
    """State of a trajectory timer."""

    time: float  # time of the path in [s]
    speed_scaling: float  # seconds of the path per second
    change: float  # change of the speed scaling in [1/s]
    wanted: float  # requested speed scaling
    waiting: float = 0.0  # time before the start in [s]


class TrajectoryTimer:
    """Runs through a path at a speed scaling of 0 to 1 that changes smoothly.

    When it stops, it may overshoot slightly and go back.
    """

    def __init__(self, limits: JointLimits, speed_scaling: float) -> None:
        """Start at time 0 of a path."""
        self._limits = limits
        self._otg = ruckig.Ruckig(1)
        self._demand = ruckig.InputParameter(1)
        self._demand.control_interface = ruckig.ControlInterface.Velocity
        self._demand.max_velocity = [10.0]
        self._wanted = speed_scaling
        self.time = 0.0  # of the path in [s]
        self.speed_scaling = speed_scaling  # seconds of the path per second
        self.change = 0.0  # of the speed scaling in [1/s]

    @property
    def state(self) -> TimerState:
        """The state of the timer."""
        return TimerState(self.time, self.speed_scaling, self.change, self._wanted)

    def begin(self, speed_scaling: float) -> None:
        """Start with a speed scaling; the arm rests and the path begins at rest."""
        self._wanted = self.speed_scaling = speed_scaling

    def ahead(self, time: float) -> tuple[float, float, float]:
        """Predict path time, speed scaling and its rate, constant until the requested scaling."""
        gap = self._wanted - self.speed_scaling
        if self.change * gap <= 0.0:
            return self.time + self.speed_scaling * time, self.speed_scaling, self.change
        changing = gap / self.change
        if time < changing:
            way = (self.speed_scaling + 0.5 * self.change * time) * time
            return self.time + way, self.speed_scaling + self.change * time, self.change
        way = (self.speed_scaling + 0.5 * gap) * changing + self._wanted * (time - changing)
        return self.time + way, self._wanted, 0.0

    @property
    def stopped(self) -> bool:
        """Whether the timer has stopped."""
        return self.speed_scaling == 0.0 and self.change == 0.0

    def step(self, path: Path, wanted: float, period: float) -> None:
        """Advance by one period towards a requested speed scaling."""
        self._wanted = wanted
        if self.speed_scaling == wanted and self.change == 0.0:
            self.time += self.speed_scaling * period
            return
        quickest, abruptest = self._room(path, 1.0 if wanted > self.speed_scaling else -1.0)
        abruptest = min(abruptest, quickest / (MIN_BUILD_UP_CYCLES * period))
        demand = self._demand
        demand.current_position = [self.time]
        demand.current_velocity = [self.speed_scaling]
        demand.current_acceleration = [self.change]
        demand.target_velocity = [wanted]
        demand.max_acceleration = [quickest]
        demand.max_jerk = [abruptest]
        trajectory = ruckig.Trajectory(1)
        try:
            self._otg.calculate(demand, trajectory)
        except ruckig.RuckigError:  # at once, rather than not at all; the joints are limited yet
            self.time, self.speed_scaling, self.change = self.time + wanted * period, wanted, 0.0
            return
        if trajectory.duration <= period:
            reached = trajectory.at_time(trajectory.duration)[0][0]
            left = period - trajectory.duration
            self.time, self.speed_scaling, self.change = reached + wanted * left, wanted, 0.0
            return
        values = (each[0] for each in trajectory.at_time(period))
        self.time, self.speed_scaling, self.change = values

    @classmethod
    def foreseen(
        cls, limits: JointLimits, path: Path, state: TimerState, ahead: float
    ) -> TimerState:
        """Predict the timer state ``ahead`` [s] from now if nothing intervenes.

        Negative ``ahead`` extrapolates into the past at the present speed.
        """
        left = ahead - state.waiting if ahead > state.waiting else min(ahead, 0.0)
        timer = cls(limits, state.speed_scaling)
        timer.time, timer.change = state.time, state.change
        while left > FORESIGHT_STEP and (timer.change or timer.speed_scaling != state.wanted):
            timer.step(path, state.wanted, FORESIGHT_STEP)
            left -= FORESIGHT_STEP
        if left > 0.0:
            timer.step(path, state.wanted, left)
        else:
            timer.time += left * timer.speed_scaling
        return timer.state

    def _room(self, path: Path, sense: float) -> tuple[float, float]:
        """Return the limits of the rate of the speed scaling [1/s] and its change [1/s2]."""
        here, soon, limits = path.at(self.time), path.at(self.time + JERK_LOOKAHEAD), self._limits
        speed = np.maximum(np.abs(here.velocity), 1e-9)
        bend = np.maximum(np.abs(here.acceleration), np.abs(soon.acceleration))
        bend *= self.speed_scaling
        used = sense * np.sign(here.velocity) * here.acceleration * self.speed_scaling**2
        room = np.maximum(
            ACCELERATION_FACTOR * limits.acceleration - used, MIN_ROOM_FACTOR * limits.acceleration
        )
        # by the chain rule a change c of the scaling p costs jerk: three times acceleration p c,
        # and velocity dc/dt, beside the path's own jerk p^3
        quickest = min(
            float(np.min(room / speed)),
            float(np.min(JERK_FACTOR * limits.jerk / np.maximum(3.0 * bend, 1e-9))),
        )
        own = (
            np.abs(soon.acceleration - here.acceleration) / JERK_LOOKAHEAD * self.speed_scaling**3
        )
        left = limits.jerk - own - 3.0 * bend * abs(self.change)
        left = JERK_FACTOR * np.maximum(left, MIN_ROOM_FACTOR * limits.jerk)
        abruptest = float(np.min(left / speed))
        return min(quickest, MAX_SCALING_RATE), min(abruptest, MAX_SCALING_ACCELERATION)


INTERCEPTION_CYCLES = (4, 10, 25, 60, 150)  # cycles after which an interception is tried
MAX_ITERATIONS = 3  # iterations that refine the time of a later interception

PLAN_TOLERANCE = 1e-7
"""Tolerance in [rad] for keeping a planned interception; 100 times as much in [rad/s]."""

ROUNDING_FACTOR = 1.0 + 1e-6  # tolerated rounding of velocities and accelerations

JERK_TOLERANCE = 0.1
"""Deviations of velocity and position per cycle from constant jerk that are tolerated.

As shares of j T^2 and j T^3.
"""

ACCELERATION_TOLERANCE = 0.01  # tolerated position step at meeting a path, as a share of a T^2

FOLLOWING_JERK_TOLERANCE = (0.25, 0.129)
"""The same while already following exactly: a limited jerk that changes sign causes as much."""


class CatchUpInterpolator:
    """Follows a moving reference state within the joint limits.

    A step that the limits allow follows the reference exactly. Otherwise it plans an interception
    with the predicted reference, and keeps the plan while the prediction holds. Replanning in
    every cycle would postpone the interception again and again.
    """

    def __init__(self, limits: JointLimits, generator: OnlineTrajectoryGenerator) -> None:
        self._limits = limits
        self._generator = generator
        self._plan: Plan | None = None
        self._elapsed = 0.0
        self.exact = False  # whether the last step is exactly on the reference

    def step(
        self, state: RobotState, ahead: Callable[[float], RobotState], period: float
    ) -> RobotState | None:
        """Advance by one period.

        Args:
            ahead: Function from time from now in [s] to the reference state.

        Returns:
            The state to command next; None if the reference cannot be intercepted.
        """
        wanted = ahead(period)
        if self._allowed(state, wanted, period):
            self._plan, self.exact = None, True
            return wanted
        self.exact = False
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
        """Return whether the plan still starts at the state and ends on the reference."""
        if self._plan is None:
            return False
        left = self._plan.duration - self._elapsed
        foreseen, now = self._within(ahead(left)), self._plan.at(self._elapsed)
        return _same(now, state) and _same(self._plan.at(self._plan.duration), foreseen)

    def _allowed(self, state: RobotState, wanted: RobotState, period: float) -> bool:
        """Return whether a jerk within the limits leads from one state to the other."""
        if not self._soft(state, wanted, period):
            return False
        most = self._limits.jerk * period
        jolt, shift = FOLLOWING_JERK_TOLERANCE if self.exact else (JERK_TOLERANCE, JERK_TOLERANCE)
        mean = 0.5 * (state.acceleration + wanted.acceleration) * period
        if np.any(np.abs(wanted.velocity - state.velocity - mean) > jolt * most * period):
            return False
        bend = (2.0 * state.acceleration + wanted.acceleration) / 6.0 * period
        way = wanted.position - state.position - (state.velocity + bend) * period
        allowed = shift * most * period**2
        if not self.exact:  # seen on the positions it is a change of speed
            allowed = np.minimum(
                allowed, ACCELERATION_TOLERANCE * self._limits.acceleration * period**2
            )
        return bool(np.all(np.abs(way) <= allowed))

    def _soft(self, state: RobotState, wanted: RobotState, period: float) -> bool:
        """Return whether a state is within limits, with acceleration near the present one."""
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
        """Plan to intercept the reference, as early as possible; None if it cannot be met."""
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
        """Return a state with velocity and acceleration clipped to the limits."""
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
