# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""When each leg stands and swings, for each gait."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import Enum
import math


class Gait(Enum):
    """The gaits; the value is their name in ``set_mode``."""

    TROT = 'trot'
    CRAWL = 'crawl'
    PACE = 'pace'


@dataclass(frozen=True, slots=True)
class Schedule:
    """A gait; phases are shares of a period.

    A leg stands while its own phase (the gait's plus its offset) is below the duty.
    """

    # lead of each leg's phase, front left, front right, back left, back right
    offsets: tuple[float, float, float, float]
    stance_duration: float  # how long a foot stays on the ground in [s]
    duty: float  # share of the period that a foot stands
    sway: float  # how far the body moves to the side away from the legs in the air in [m]
    # largest speed of a foot over the body that the gait keeps its balance at in [m/s]
    speed: float

    def scaled(self, leg_length: float) -> Schedule:
        """Return the gait of a robot with other legs [m].

        At equal Froude numbers (v^2 / g l) times and speeds grow with the root of the legs.
        """
        size = leg_length / LEG_LENGTH
        if abs(size - 1.0) < 0.01:
            return self
        root = math.sqrt(size)
        return replace(
            self,
            stance_duration=self.stance_duration * root,
            sway=self.sway * size,
            speed=self.speed * root,
        )

    @property
    def period(self) -> float:
        """Duration of a cycle in [s]."""
        return self.stance_duration / self.duty

    @property
    def swing_duration(self) -> float:
        """How long a foot is in the air in [s]."""
        return self.period - self.stance_duration

    @property
    def sway_phase(self) -> float:
        """Phase at which the middle of the left legs' swings lies; the body is right then.

        It is the phase of the first harmonic of "left legs in the air minus right legs".
        """
        sides = (1.0, -1.0, 1.0, -1.0)
        centre = (1.0 + self.duty) / 2  # of the swing, in the leg's own phase
        angles = [math.tau * (centre - offset) for offset in self.offsets]
        sine = sum(side * math.sin(angle) for side, angle in zip(sides, angles, strict=True))
        cosine = sum(side * math.cos(angle) for side, angle in zip(sides, angles, strict=True))
        return math.atan2(sine, cosine) / math.tau


LEG_LENGTH = 0.1349  # [m] thigh and calf of the XGO
SCHEDULES = {
    Gait.TROT: Schedule((0.0, 0.5, 0.5, 0.0), 0.1456, 0.52, 0.0, 0.45),
    Gait.CRAWL: Schedule((0.0, 0.5, 0.75, 0.25), 0.8, 0.8, 0.012, 0.06),
    Gait.PACE: Schedule((0.0, 0.5, 0.0, 0.5), 0.12, 0.6, 0.0, 0.13),
}
"""The gaits as they were found to walk in physics simulation with the XGO's dimensions."""
