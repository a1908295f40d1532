# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
r"""Profiles of constant acceleration, in closed form.

A motion is a sequence of segments; in each, with :math:`s = t - t_0`,

.. math::
    p(t) = p_0 + v_0 s + \tfrac{1}{2} a s^2, \qquad v(t) = v_0 + a s.

Positions are in [inc], velocities in [inc/s], accelerations in [inc/s^2], times on the steady
clock in [s]. The planners start from any position and velocity, so a motion can take another's
place at any time without a jump in either.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
import math
from typing import NamedTuple


class Segment(NamedTuple):
    """A segment of constant acceleration; it lasts until the next one begins.

    Attributes:
        start: Time at which it begins.
        position: Position at its start.
        velocity: Velocity at its start.
        acceleration: Acceleration throughout.
    """

    start: float
    position: float
    velocity: float
    acceleration: float


class Point(NamedTuple):
    """Position, velocity and acceleration at one time."""

    position: float
    velocity: float
    acceleration: float


class Phase(NamedTuple):
    """A duration in [s] and the acceleration during it."""

    duration: float
    acceleration: float


@dataclass(frozen=True, slots=True)
class Limits:
    """What a planned motion keeps to; all are positive.

    Attributes:
        velocity: Highest speed.
        acceleration: While the speed grows.
        deceleration: While it shrinks.
    """

    velocity: float
    acceleration: float
    deceleration: float


class Motion:
    """A sequence of segments; the last one continues without end, at constant velocity.

    Attributes:
        segments: In the order of time.
        end: Time at which the last segment begins.
    """

    __slots__ = ('end', 'segments')

    def __init__(self, segments: Sequence[Segment]) -> None:
        self.segments = tuple(segments)
        self.end = self.segments[-1].start

    def at(self, time: float) -> Point:
        """Return where the motion is; before its start it is at its start."""
        for segment in reversed(self.segments):
            if segment.start <= time:
                break
        return advanced(segment, max(0.0, time - segment.start))

    def time_at(self, position: float) -> float:
        """Return when the motion first passes a position, infinite when it does not."""
        for index, segment in enumerate(self.segments):
            last = index == len(self.segments) - 1
            length = math.inf if last else self.segments[index + 1].start - segment.start
            elapsed = _time_to(segment, position)
            if elapsed <= length:
                return segment.start + elapsed
        return math.inf

    def pieces(self, begin: float, end: float) -> Iterator[tuple[Point, float]]:
        """Yield the start of each segment between two times, and its duration in [s]."""
        for index, segment in enumerate(self.segments):
            last = index == len(self.segments) - 1
            stop = end if last else min(end, self.segments[index + 1].start)
            start = max(begin, segment.start)
            if stop > start:
                yield advanced(segment, start - segment.start), stop - start
            if stop >= end:
                return


def advanced(segment: Segment, elapsed: float) -> Point:
    """Return where a segment has arrived after a time in [s]."""
    velocity = segment.velocity + segment.acceleration * elapsed
    mean = 0.5 * (segment.velocity + velocity)
    return Point(segment.position + mean * elapsed, velocity, segment.acceleration)


def _time_to(segment: Segment, position: float) -> float:
    """Return how long a segment takes to a position, infinite when it never gets there."""
    way, velocity, acceleration = (
        position - segment.position,
        segment.velocity,
        segment.acceleration,
    )
    if way == 0.0:
        return 0.0
    root = velocity**2 + 2.0 * acceleration * way
    if root < 0.0:
        return math.inf
    # the smaller positive root, in the form without cancellation
    times = [
        2.0 * way / (velocity + sign * math.sqrt(root))
        for sign in (1.0, -1.0)
        if velocity + sign * math.sqrt(root)
    ]
    return min((time for time in times if time > 0.0), default=math.inf)


def hold(position: float, now: float) -> Motion:
    """Stand still."""
    return Motion((Segment(now, position, 0.0, 0.0),))


def plan_line(position: float, target: float, duration: float, now: float) -> Motion:
    """Go to a target at constant velocity in a given time, then stand still."""
    velocity = (target - position) / duration
    return Motion(
        (
            Segment(now, position, velocity, 0.0),
            Segment(now + duration, target, 0.0, 0.0),
        )
    )


def plan_velocity(start: Point, target: float, limits: Limits, now: float) -> Motion:
    """Ramp to a velocity and keep it; through a stop when the direction changes.

    Args:
        start: Present position and velocity.
        target: Velocity to reach; its amount is limited.
        limits: Acceleration away from zero, deceleration towards it.
        now: Start time.
    """
    target = math.copysign(min(abs(target), limits.velocity), target)
    phases = []
    velocity = start.velocity
    if velocity * target < 0.0:
        phases.append(_ramp(velocity, 0.0, limits.deceleration))
        velocity = 0.0
    growing = abs(target) > abs(velocity)
    rate = limits.acceleration if growing else limits.deceleration
    phases.append(_ramp(velocity, target, rate))
    segments = _join(start, phases, now)
    return Motion((*segments[:-1], segments[-1]._replace(velocity=target)))


def plan_move(start: Point, target: float, limits: Limits, now: float) -> Motion:
    """Go to a position and stand still there, as fast as the limits allow.

    Args:
        start: Present position and velocity.
        target: Position to reach.
        limits: Velocity, acceleration and deceleration.
        now: Start time.
    """
    braking = start.velocity * abs(start.velocity) / (2.0 * limits.deceleration)
    sign = math.copysign(1.0, target - start.position - braking)
    # from here on towards positive positions; the rest is mirrored back
    velocity = sign * start.velocity
    distance = sign * (target - start.position)
    phases = []
    if velocity < 0.0:  # moves away from the target, or cannot stop before it
        phases.append(_ramp(velocity, 0.0, limits.deceleration))
        distance += velocity**2 / (2.0 * limits.deceleration)
        velocity = 0.0
    elif velocity > limits.velocity:
        phases.append(_ramp(velocity, limits.velocity, limits.deceleration))
        distance -= (velocity**2 - limits.velocity**2) / (2.0 * limits.deceleration)
        velocity = limits.velocity
    phases += _trapezoid(distance, velocity, limits)
    segments = _join(start, [Phase(p.duration, sign * p.acceleration) for p in phases], now)
    return Motion((*segments[:-1], Segment(segments[-1].start, target, 0.0, 0.0)))


def _trapezoid(distance: float, velocity: float, limits: Limits) -> list[Phase]:
    r"""Accelerate, cruise and brake over a distance that suffices to brake from ``velocity``.

    Without a cruise the peak velocity :math:`v_p` fulfils
    :math:`(v_p^2 - v^2) / 2a + v_p^2 / 2d = s`.
    """
    up, down = limits.acceleration, limits.deceleration
    peak_squared = down * (2.0 * up * distance + velocity**2) / (up + down)
    peak = min(limits.velocity, math.sqrt(max(peak_squared, velocity**2)))
    rest = distance - (peak**2 - velocity**2) / (2.0 * up) - peak**2 / (2.0 * down)
    cruise = Phase(max(0.0, rest / peak), 0.0) if peak else Phase(0.0, 0.0)
    return [_ramp(velocity, peak, up), cruise, _ramp(peak, 0.0, down)]


def _ramp(velocity: float, target: float, rate: float) -> Phase:
    return Phase(abs(target - velocity) / rate, math.copysign(rate, target - velocity))


def _join(start: Point, phases: Sequence[Phase], now: float) -> list[Segment]:
    """Chain phases; the last segment keeps the velocity that they end with."""
    segments = []
    time, position, velocity = now, start.position, start.velocity
    for duration, acceleration in phases:
        if duration > 0.0:
            segment = Segment(time, position, velocity, acceleration)
            segments.append(segment)
            position, velocity, _ = advanced(segment, duration)
            time += duration
    segments.append(Segment(time, position, velocity, 0.0))
    return segments
