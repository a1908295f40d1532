# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The clock of a path: how fast it is walked, with limited acceleration and jerk of the joints."""

from __future__ import annotations

import numpy as np
import ruckig

from .limits import JointLimits
from .path import Path

QUICKEST = 10.0
"""Greatest change of the pace in [1/s], for where the path asks nothing of the joints."""

ABRUPTEST = 200.0
"""Greatest change of that in [1/s2]."""

SHARE = 0.9
"""Share of the joints' acceleration that a change of the pace may bring them to."""

JERK_SHARE = 0.4
"""Share of the joints' jerk that a change of the pace may ask."""

SPREAD = 5.0
"""Cycles at least in which a change of the pace builds up."""

FLOOR = 0.2
"""Share of its room that a change of the pace has where the path leaves none."""

SOON = 0.01
"""How far ahead on the path its own jerk is looked for in [s]."""


class PathClock:
    """Walks a path at a pace of 0 to 1 that changes smoothly.

    Coming to a stop it may overrun by a little, and walk that back.

    Attributes:
        time: Time of the path in [s].
        pace: Seconds of the path per second.
        change: Change of the pace in [1/s].
    """

    def __init__(self, limits: JointLimits, pace: float) -> None:
        """Start at the begin of a path.

        Args:
            limits: Limits of the joints.
            pace: Pace to start with.
        """
        self._limits = limits
        self._otg = ruckig.Ruckig(1)
        self._demand = ruckig.InputParameter(1)
        self._demand.control_interface = ruckig.ControlInterface.Velocity
        self._demand.max_velocity = [10.0]
        self._wanted = pace
        self.time = 0.0
        self.pace = pace
        self.change = 0.0

    def ahead(self, time: float) -> tuple[float, float, float]:
        """Foresee time, pace and change, for a change that goes on evenly until the wanted pace.

        Args:
            time: How far ahead in [s].
        """
        gap = self._wanted - self.pace
        if self.change * gap <= 0.0:
            return self.time + self.pace * time, self.pace, self.change
        changing = gap / self.change
        if time < changing:
            way = (self.pace + 0.5 * self.change * time) * time
            return self.time + way, self.pace + self.change * time, self.change
        way = (self.pace + 0.5 * gap) * changing + self._wanted * (time - changing)
        return self.time + way, self._wanted, 0.0

    @property
    def stopped(self) -> bool:
        """Whether it stands still."""
        return self.pace == 0.0 and self.change == 0.0

    def step(self, path: Path, wanted: float, period: float) -> None:
        """Advance.

        Args:
            path: The path.
            wanted: Pace to reach.
            period: Time to advance by in [s].
        """
        self._wanted = wanted
        if self.pace == wanted and self.change == 0.0:
            self.time += self.pace * period
            return
        quickest, abruptest = self._room(path, 1.0 if wanted > self.pace else -1.0)
        abruptest = min(abruptest, quickest / (SPREAD * period))
        demand = self._demand
        demand.current_position = [self.time]
        demand.current_velocity = [self.pace]
        demand.current_acceleration = [self.change]
        demand.target_velocity = [wanted]
        demand.max_acceleration = [quickest]
        demand.max_jerk = [abruptest]
        trajectory = ruckig.Trajectory(1)
        try:
            self._otg.calculate(demand, trajectory)
        except ruckig.RuckigError:  # at once, rather than not at all; the joints are limited yet
            self.time, self.pace, self.change = self.time + wanted * period, wanted, 0.0
            return
        if trajectory.duration <= period:
            reached = trajectory.at_time(trajectory.duration)[0][0]
            left = period - trajectory.duration
            self.time, self.pace, self.change = reached + wanted * left, wanted, 0.0
            return
        self.time, self.pace, self.change = (values[0] for values in trajectory.at_time(period))

    def _room(self, path: Path, sense: float) -> tuple[float, float]:
        """Return how fast the pace may change in [1/s], and that in [1/s2]."""
        here, soon, limits = path.at(self.time), path.at(self.time + SOON), self._limits
        speed = np.maximum(np.abs(here.velocity), 1e-9)
        bend = np.maximum(np.abs(here.acceleration), np.abs(soon.acceleration)) * self.pace
        used = sense * np.sign(here.velocity) * here.acceleration * self.pace**2
        room = np.maximum(SHARE * limits.acceleration - used, FLOOR * limits.acceleration)
        # by the chain rule a change c of the pace p costs jerk: three times acceleration p c, and
        # velocity dc/dt, beside the path's own jerk p^3
        quickest = min(
            float(np.min(room / speed)),
            float(np.min(JERK_SHARE * limits.jerk / np.maximum(3.0 * bend, 1e-9))),
        )
        own = np.abs(soon.acceleration - here.acceleration) / SOON * self.pace**3
        left = limits.jerk - own - 3.0 * bend * abs(self.change)
        left = JERK_SHARE * np.maximum(left, FLOOR * limits.jerk)
        abruptest = float(np.min(left / speed))
        return min(quickest, QUICKEST), min(abruptest, ABRUPTEST)
