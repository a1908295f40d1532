# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Speed scaling: how fast a trajectory runs now, with limited acceleration and jerk of the joints.

Speed override, pause, resume and cancel are changes of the speed scaling; the path stays the same.
What makes a path feasible before it begins is the time scaling of :mod:`..paths.time_scaling`.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import ruckig

from arm_model import JointLimits

from ..paths.path import Path

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

    Attributes:
        time: Time of the path in [s].
        speed_scaling: Seconds of the path per second.
        change: Change of the speed scaling in [1/s].
    """

    def __init__(self, limits: JointLimits, speed_scaling: float) -> None:
        """Start at the begin of a path.

        Args:
            speed_scaling: Seconds of the trajectory per second to start with.
        """
        self._limits = limits
        self._otg = ruckig.Ruckig(1)
        self._demand = ruckig.InputParameter(1)
        self._demand.control_interface = ruckig.ControlInterface.Velocity
        self._demand.max_velocity = [10.0]
        self._wanted = speed_scaling
        self.time = 0.0
        self.speed_scaling = speed_scaling
        self.change = 0.0

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
        """Return where a timer will be when nothing comes in between.

        Args:
            ahead: Time from now in [s]; less than 0 is the past, at the present speed.
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
