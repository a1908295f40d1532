# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Foot trajectories: stance feet stay on the ground, swing feet move to their next foothold.

In the body frame, a stance foot moves with the negative body velocity at that foot, turning
included, so it never slips. A swing foot follows a cubic Hermite curve that lifts off and touches
down at ground velocity, so it does not scuff. It lands half a stroke ahead of its neutral place
(Raibert's neutral point).
"""

from __future__ import annotations

from bisect import bisect
from collections.abc import Callable, Iterator
from dataclasses import dataclass
import itertools
import math

from quad_description import Feet, Quadruped
from quad_description.rotations import Vector

from .parameters import Schedule
from .velocity import Velocity

SPEED_RATIO = 0.97  # of the joints' speed; levelling and turning take their part, too
SPEEDS = 5  # how many speeds of a foot are looked at, up to that of the gait
SAMPLES = 8  # of a swing
HALVINGS = 5  # of the height
MIN_RATIO = 0.7  # of the height on the spot: a foot that scuffs is worse than a slow joint


class SwingLift:
    """Swing height as a function of foot velocity, so that no joint exceeds its speed limit.

    A swing moves a foot a whole stroke ahead in less time than the stroke took, and lifts it.
    Where the servos are too slow for both, as in a fast trot or the short swing of a pace, they
    would fall behind the curve anywhere; a lower lift avoids that. It must not be much lower: in
    simulation, a trot at 0.3 m/s with half the lift stumbles.
    """

    def __init__(
        self, robot: Quadruped, neutral: Feet, schedule: Schedule, swing_height: float
    ) -> None:
        """Tabulate the height [m] over forward and sideways speeds, around neutral feet."""
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
        """Yield the positions of all feet along a swing."""
        for sample in range(SAMPLES + 1):
            part = sample / SAMPLES
            way_x, way_y = (swing_way(over, part, self._schedule) for over in (x, y))
            up = height * arc(part)
            one, two, three, four = ((a + way_x, b + way_y, c + up) for a, b, c in self._neutral)
            yield one, two, three, four


def arc(part: float) -> float:
    """Return the normalized height of a swing, 0 to 1; part runs from 0 to 1."""
    return 0.5 * (1.0 - math.cos(math.tau * part))


def swing_way(velocity: float, part: float, schedule: Schedule) -> float:
    """Return the offset from the neutral position [m] in a swing at constant velocity [m/s]."""
    half, slope = 0.5 * schedule.stance_duration * velocity, -velocity * schedule.swing_duration
    return hermite((-half, slope), (half, slope), part)


def hermite(start: tuple[float, float], end: tuple[float, float], part: float) -> float:
    """Interpolate two values with given slopes by a cubic; part runs from 0 to 1."""
    rest = 1.0 - part
    rise = part * part * (3.0 - 2.0 * part)
    bend = part * rest * (start[1] * rest - end[1] * part)
    return start[0] + (end[0] - start[0]) * rise + bend


FULL_LIFT_SPEED = 0.03  # [m/s] slower steps are lifted less
FULL_LIFT_TRAVEL = 0.01  # [m] shorter steps are lifted less
AT_PLACE = 1e-6  # [m] as near to its neutral place as a foot needs to be


@dataclass(slots=True)
class _Foot:
    """Offset of a foot from its neutral position and from its lift-off point, in [m]."""

    x: float = 0.0
    y: float = 0.0
    z: float = 0.0
    swings: bool = False
    start_x: float = 0.0
    start_y: float = 0.0


class Stepper:
    """Computes the trajectories of four feet through a gait."""

    def __init__(
        self,
        schedule: Schedule,
        neutral: Feet,
        lift: Callable[[float, float], float],
        depth: float,
    ) -> None:
        """Start with all feet at their neutral positions.

        Args:
            neutral: Foot positions at rest, in the body's frame in [m].
            depth: How far a standing foot is pushed below the ground in [m].
        """
        self.schedule = schedule  # the gait; may be exchanged while the feet stand
        self._neutral = neutral
        # how high a foot is lifted [m] in it, by its velocity over the ground [m/s]
        self.lift = lift
        self._depth = depth
        self._feet = [_Foot() for _ in neutral]
        self._phase = 0.0  # share of the period that has passed
        self.walking = False  # whether any foot is off its neutral place or about to step
        self._engaged = 0.0

    @property
    def contacts(self) -> tuple[bool, ...]:
        """Whether each foot is in stance."""
        return tuple(not foot.swings for foot in self._feet)

    @property
    def sway(self) -> float:
        """Required offset of the body to the left in [m]."""
        schedule = self.schedule
        angle = math.tau * (self._phase - schedule.sway_phase)
        return -schedule.sway * self._engaged * math.cos(angle)

    def reset(self) -> None:
        """Put all feet back to their neutral positions at once."""
        self._feet = [_Foot() for _ in self._neutral]
        self._phase = self._engaged = 0.0
        self.walking = False

    def step(self, velocity: Velocity, dt: float) -> list[Vector]:
        """Advance; return the feet in the frame of a level body in [m]."""
        if not self.walking and not velocity.at_rest:
            self.walking = True
            self._phase = 0.0
        if self.walking:
            self._advance(velocity, dt)
        if self.walking and velocity.at_rest and self._all_at_place() and self._engaged <= 0.0:
            self.reset()
        return [
            (place[0] + foot.x, place[1] + foot.y, place[2] + foot.z)
            for place, foot in zip(self._neutral, self._feet, strict=True)
        ]

    def _advance(self, velocity: Velocity, dt: float) -> None:
        period = self.schedule.period
        self._phase = math.fmod(self._phase + dt / period, 1.0)
        # the sway comes and goes within a period, so that neither start nor stop is a jerk
        goal = 0.0 if velocity.at_rest else 1.0
        self._engaged += min(max(goal - self._engaged, -dt / period), dt / period)
        legs = zip(self._neutral, self._feet, self.schedule.offsets, strict=True)
        for place, foot, offset in legs:
            hip_x = velocity.x - velocity.yaw * place[1]
            hip_y = velocity.y + velocity.yaw * place[0]
            leg_phase = math.fmod(self._phase + offset, 1.0)
            if leg_phase >= self.schedule.duty:
                self._swing(foot, leg_phase, velocity, (hip_x, hip_y), dt)
                continue
            stood = self._land(foot, leg_phase, hip_x, hip_y) if foot.swings else dt
            push = math.sin(math.pi * leg_phase / self.schedule.duty)
            foot.z = -self._depth * self._engaged * push
            # how the ground moves under the foot itself, which is not just below the hip
            turn_x, turn_y = -velocity.yaw * foot.y, velocity.yaw * foot.x
            foot.x -= (hip_x + turn_x) * min(stood, dt)
            foot.y -= (hip_y + turn_y) * min(stood, dt)

    def _land(self, foot: _Foot, phase: float, hip_x: float, hip_y: float) -> float:
        """End a swing that finished within this step; return the stance time since then in [s]."""
        foot.swings = False
        half = 0.5 * self.schedule.stance_duration
        foot.x, foot.y = half * hip_x, half * hip_y
        return phase * self.schedule.period

    def _swing(
        self, foot: _Foot, phase: float, velocity: Velocity, hip: tuple[float, float], dt: float
    ) -> None:
        schedule = self.schedule
        hip_x, hip_y = hip
        if not foot.swings:
            foot.swings = True
            stood = max(dt - (phase - schedule.duty) * schedule.period, 0.0)
            foot.start_x = foot.x - (hip_x - velocity.yaw * foot.y) * stood
            foot.start_y = foot.y - (hip_y + velocity.yaw * foot.x) * stood
        part = (phase - schedule.duty) / (1.0 - schedule.duty)
        half, duration, yaw = 0.5 * schedule.stance_duration, schedule.swing_duration, velocity.yaw
        end_x, end_y = half * hip_x, half * hip_y
        foot.x = hermite(
            (foot.start_x, (yaw * foot.start_y - hip_x) * duration),
            (end_x, (yaw * end_y - hip_x) * duration),
            part,
        )
        foot.y = hermite(
            (foot.start_y, (-yaw * foot.start_x - hip_y) * duration),
            (end_y, (-yaw * end_x - hip_y) * duration),
            part,
        )
        travel = math.hypot(end_x - foot.start_x, end_y - foot.start_y)
        speed = math.hypot(hip_x, hip_y)
        scale = min(1.0, max(speed / FULL_LIFT_SPEED, travel / FULL_LIFT_TRAVEL))
        foot.z = self.lift(hip_x, hip_y) * scale * arc(part)

    def _all_at_place(self) -> bool:
        return all(
            abs(foot.x) < AT_PLACE and abs(foot.y) < AT_PLACE and abs(foot.z) < AT_PLACE
            for foot in self._feet
        )
