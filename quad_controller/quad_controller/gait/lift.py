# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How high a swinging foot is lifted, so that no joint needs more than its speed.

A swing carries a foot a whole stroke ahead in less time than the stroke took, and lifts it on the
way. Where both together are too much for the servos, as in a fast trot or the short swing of a
pace, they would cut the curve wherever they fall behind; it is better to lift the foot less. But
not much less: in physics a trot of 0.3 m/s that lifts its feet by half stumbles over them.
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Iterator
import itertools
import math

from quad_description import Feet, Quadruped

from .schedule import Schedule

SPEED_RATIO = 0.97  # of the joints' speed; levelling and turning take their part, too
SPEEDS = 5  # how many speeds of a foot are looked at, up to that of the gait
SAMPLES = 8  # of a swing
HALVINGS = 5  # of the height
MIN_RATIO = 0.7  # of the height on the spot: a foot that scuffs is worse than a slow joint


class SwingLift:
    """Height of a swing by the velocity of its foot over the ground."""

    def __init__(
        self, robot: Quadruped, neutral: Feet, schedule: Schedule, swing_height: float
    ) -> None:
        """Look for the height at some speeds, ahead and to the side.

        Args:
            robot: Whose joints have limits of their speed.
            neutral: Where the feet are without motion, in the body's frame [m].
            swing_height: How high a foot is lifted where the joints allow it [m].
        """
        self._robot, self._neutral, self._schedule = robot, neutral, schedule
        step = schedule.speed / (SPEEDS - 1)
        self._speeds = [step * index for index in range(SPEEDS)]
        most = self._highest(0.0, 0.0, 0.0, swing_height)
        least = MIN_RATIO * most
        self._ahead, self._aside = (
            [self._highest(speed * x, speed * y, least, most) for speed in self._speeds]
            for x, y in ((1.0, 0.0), (0.0, 1.0))
        )

    def height(self, x: float, y: float) -> float:
        """Return the height [m] for a velocity of the foot over the ground [m/s]."""
        return min(self._at(abs(x), self._ahead), self._at(abs(y), self._aside))

    def _at(self, speed: float, heights: list[float]) -> float:
        index = min(max(bisect(self._speeds, speed), 1), SPEEDS - 1)
        low, high = self._speeds[index - 1 : index + 1]
        share = min((speed - low) / (high - low), 1.0)
        return heights[index - 1] + share * (heights[index] - heights[index - 1])

    def _highest(self, x: float, y: float, least: float, most: float) -> float:
        if self._within_speed(x, y, most):
            return most
        low, high = least, most
        for _ in range(HALVINGS):
            middle = 0.5 * (low + high)
            if self._within_speed(x, y, middle):
                low = middle
            else:
                high = middle
        return low

    def _within_speed(self, x: float, y: float, height: float) -> bool:
        step = self._schedule.swing_duration / SAMPLES
        places = (
            [solution.angles for solution in self._robot.solve(feet)]
            for feet in self._swing(x, y, height)
        )
        return all(
            abs(now - last) <= SPEED_RATIO * self._robot.limits[index].velocity * step
            for before, after in itertools.pairwise(places)
            for indices, one, other in zip(self._robot.leg_indices, before, after, strict=True)
            for index, last, now in zip(indices, one, other, strict=True)
        )

    def _swing(self, x: float, y: float, height: float) -> Iterator[Feet]:
        """Yield the feet along a swing, all at once."""
        half, duration = 0.5 * self._schedule.stance_duration, self._schedule.swing_duration
        for sample in range(SAMPLES + 1):
            part = sample / SAMPLES
            way_x, way_y = (
                hermite((-half * v, -v * duration), (half * v, -v * duration), part)
                for v in (x, y)
            )
            up = height * arc(part)
            one, two, three, four = ((a + way_x, b + way_y, c + up) for a, b, c in self._neutral)
            yield one, two, three, four


def arc(part: float) -> float:
    """Return the height of a swing as a share of its greatest; part runs from 0 to 1."""
    return 0.5 * (1.0 - math.cos(math.tau * part))


def hermite(start: tuple[float, float], end: tuple[float, float], part: float) -> float:
    """Return a cubic between two values.

    Args:
        start: Value and change per part at part 0.
        end: The same at part 1.
        part: How much of the way is done, 0 to 1.
    """
    rest = 1.0 - part
    rise = part * part * (3.0 - 2.0 * part)
    bend = part * rest * (start[1] * rest - end[1] * part)
    return start[0] + (end[0] - start[0]) * rise + bend
