# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What was commanded and measured, cycle by cycle, and what is computed from it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from arm_model import Array


@dataclass(frozen=True, slots=True, eq=False)
class Sample:
    """One state of the trajectory controller.

    Attributes:
        time: Time of its cycle in [s].
        position: Commanded positions in [rad].
        velocity: Commanded velocities in [rad/s].
        acceleration: Commanded accelerations in [rad/s2].
        measured: Measured positions in [rad].
        speed: Speed override, 0 to 1.
        tool: Commanded position of the tool in the base in [m].
        measured_tool: Measured position of the tool in [m].
    """

    time: float
    position: Array
    velocity: Array
    acceleration: Array
    measured: Array
    speed: float
    tool: Array
    measured_tool: Array


SEARCH = 6
"""How many cycles a stamp may be too early."""
CORRECTED = 18.0 * float(np.sqrt(3.0))
"""Jerk that a way in a unit of time asks for at least, beside the corrected trapezoidal rule."""
WEIGHT = 0.1
"""Weight in [s] of a change of velocity beside one of position."""
PRIOR = 1e-7
"""Weight in [rad] of a cycle beside the stamps: they count where nothing moves."""


def cycles_between(before: Sample, after: Sample, period: float) -> int:
    """Return how many cycles lie between two samples.

    A late cycle has a late stamp although its set-point is that of the nominal time; so the motion
    itself is asked: with a constant jerk, mean rates and times make the changes exactly.

    Args:
        before: The earlier one.
        after: The later one.
        period: Period of the cycle in [s].
    """
    stamped = round((after.time - before.time) / period)
    speed = (before.velocity + after.velocity) / 2
    rate = (before.acceleration + after.acceleration) / 2
    bend = (after.acceleration - before.acceleration) / 12

    def mismatch(cycles: int) -> float:
        time = cycles * period
        way = after.position - before.position - speed * time + bend * time**2
        change = WEIGHT * (after.velocity - before.velocity - rate * time)
        return float(way @ way + change @ change) + (PRIOR * (cycles - stamped)) ** 2

    return min(range(max(stamped, 0) + SEARCH), key=mismatch)  # a held-up cycle is still one


def peak_jerk(samples: Sequence[Sample], period: float, limits: Array) -> float:
    """Return the greatest jerk of a set-point, as a share of the joint's limit.

    It is the least one that makes each state from the one before, in as many cycles as their
    stamps have; where that is beyond the limit, in any number that a late cycle may have hidden.
    So a set-point that jumps counts, even where the acceleration shows nothing.

    Args:
        samples: In the order of their times.
        period: Period of the cycle in [s].
        limits: Greatest jerks in [rad/s3].
    """
    worst = 0.0
    for before, after in pairwise(samples):
        if _is_same(before, after):
            continue  # at rest, or the same cycle published twice
        stamped = max(round((after.time - before.time) / period), 1)
        jerk = _jerk(before, after, stamped * period, limits)
        if jerk > 1.0:
            counts = range(1, stamped + SEARCH)
            jerk = min(_jerk(before, after, count * period, limits) for count in counts)
        worst = max(worst, jerk)
    return worst


def _jerk(before: Sample, after: Sample, time: float, limits: Array) -> float:
    """Return the least jerk that leads from one state to another, as a share of the limit.

    Where the jerk has a bound J, the acceleration changes by no more than J t in a time t, the
    velocity differs from what the mean acceleration makes by no more than J t^2 / 4, and the
    position from what mean velocity and change of acceleration make by no more than J t^3 / (18
    sqrt 3): the integrals of the Peano kernels of the trapezoidal rule and of its corrected form.
    """
    speed = (before.velocity + after.velocity) / 2
    rate = (before.acceleration + after.acceleration) / 2
    change = after.acceleration - before.acceleration
    speeds = after.velocity - before.velocity - rate * time
    ways = after.position - before.position - speed * time + change * time**2 / 12
    jerks = np.stack([change / time, speeds * 4 / time**2, ways * CORRECTED / time**3])
    return float((np.abs(jerks) / limits).max())


def _is_same(one: Sample, other: Sample) -> bool:
    return (
        np.array_equal(one.position, other.position)
        and np.array_equal(one.velocity, other.velocity)
        and np.array_equal(one.acceleration, other.acceleration)
    )


def away_from_line(points: Sequence[Array], begin: Array, direction: Array) -> float:
    """Return the greatest distance of points from a straight line.

    Args:
        points: The points, of any dimension.
        begin: A point of the line.
        direction: Along it; need not have unit length.
    """
    unit = direction / np.linalg.norm(direction)
    worst = 0.0
    for point in points:
        offset = point - begin
        worst = max(worst, float(np.linalg.norm(offset - (offset @ unit) * unit)))
    return worst


def tool_speed(samples: Sequence[Sample], period: float) -> float:
    """Return the median speed of the commanded tool in the third quarter of a motion in [m/s].

    Args:
        samples: Of one motion at a constant speed, with its begin and its end.
        period: Period of the cycle in [s].
    """
    steady = samples[len(samples) // 2 : -(len(samples) // 4) or None]
    speeds = [
        float(np.linalg.norm(after.tool - before.tool)) / (cycles * period)
        for before, after in pairwise(steady)
        if (cycles := cycles_between(before, after, period)) >= 1
    ]
    return float(np.median(speeds)) if speeds else 0.0


def tracking_error(samples: Sequence[Sample], period: float) -> float:
    """Return the greatest distance of a measured joint from where it was sent in [rad].

    A drive answers in the cycle after the one in which it was sent somewhere, so a measurement is
    compared with the set-point of the cycle before.

    Args:
        samples: In the order of their times.
        period: Period of the cycle in [s].
    """
    worst = 0.0
    for before, after in pairwise(samples):
        if cycles_between(before, after, period) == 1:
            worst = max(worst, float(np.abs(after.measured - before.position).max()))
    return worst
