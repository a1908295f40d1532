# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A trajectory while it runs: its speed scaling, and the way of an arm that is off it.

Speed override, pause, resume and cancel are changes of the speed scaling, with limited
acceleration and jerk of the joints; the path stays the same. What makes a path feasible before it
begins is the time scaling of :mod:`.time_scaling`.
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
"""Greatest change of the speed scaling in [1/s], for where the path asks nothing of the joints."""

MAX_SCALING_ACCELERATION = 200.0  # greatest change of that in [1/s2]

ACCELERATION_FACTOR = 0.9
"""Share of the joints' acceleration that a change of the speed scaling may bring them to."""

JERK_FACTOR = 0.4  # share of the joints' jerk that a change of the speed scaling may ask
MIN_BUILD_UP_CYCLES = 5.0  # cycles at least in which a change of the speed scaling builds up

MIN_ROOM_FACTOR = 0.2
"""Share of its room that a change of the speed scaling has where the path leaves none."""

JERK_LOOKAHEAD = 0.01  # how far ahead on the path its own jerk is looked for in [s]
FORESIGHT_STEP = 0.01  # step in which a change of the speed scaling is foreseen in [s]


class TimerState(NamedTuple):
    """Where a timer is."""

    time: float  # time of the path in [s]
    speed_scaling: float  # seconds of the path per second
    change: float  # change of the speed scaling in [1/s]
    wanted: float  # speed scaling that it goes to
    waiting: float = 0.0  # time until it begins in [s]


class TrajectoryTimer:
    """Runs through a path at a speed scaling of 0 to 1 that changes smoothly.

    Coming to a stop it may overrun by a little, and go back.
    """

    def __init__(self, limits: JointLimits, speed_scaling: float) -> None:
        """Start at the begin of a path."""
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
        """Where it is."""
        return TimerState(self.time, self.speed_scaling, self.change, self._wanted)

    def begin(self, speed_scaling: float) -> None:
        """Begin at a speed scaling, from rest on a path that begins at rest."""
        self._wanted = self.speed_scaling = speed_scaling

    def ahead(self, time: float) -> tuple[float, float, float]:
        """Foresee time, speed scaling and change, which goes on evenly until it is as wanted."""
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
        """Whether it stands still."""
        return self.speed_scaling == 0.0 and self.change == 0.0

    def step(self, path: Path, wanted: float, period: float) -> None:
        """Advance."""
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
        """Return where a timer will be in [s] from now when nothing comes in between.

        Less than 0 is the past, at the present speed.
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
        """Return how fast the speed scaling may change in [1/s], and that in [1/s2]."""
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
        self.exact = False  # whether the last step is exactly on what is followed

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
