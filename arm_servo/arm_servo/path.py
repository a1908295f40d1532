# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Paths in joint space: polynomials over the time of a trajectory.

The time of the trajectory is not that of the clock: a path is walked slower, stopped and walked on
by :class:`PathClock`. Derivatives here are by the path's own time.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise, zip_longest

import numpy as np

from .arrays import Array
from .limits import JointLimits

# d^k/dt^k of the powers 0 to 5, as factors and exponents
_POWERS = np.arange(6.0)

ROOM = 1.25
"""How much longer than its peaks need the rounding of a corner takes: segments bend too."""

BRIEFEST = 0.02
"""Least half time of a rounding in [s]: a few cycles, so that sampling does not see a corner."""


@dataclass(frozen=True, slots=True, eq=False)
class PathPoint:
    """A place on a path.

    Attributes:
        position: Positions in [rad].
        velocity: First derivative by the path's time in [rad/s].
        acceleration: Second derivative by the path's time in [rad/s2].
    """

    position: Array
    velocity: Array
    acceleration: Array


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """A polynomial of at most fifth degree.

    Attributes:
        start: When it begins in [s].
        duration: How long it lasts in [s].
        coefficients: Of the powers 0 to 5 of the time since its start (6, n).
    """

    start: float
    duration: float
    coefficients: Array

    def at(self, time: float) -> PathPoint:
        """Return the place at a time of the path in [s]."""
        t = time - self.start
        powers = t**_POWERS
        first = np.concatenate(((0.0,), _POWERS[1:] * powers[:-1]))
        second = np.concatenate(((0.0, 0.0), _POWERS[2:] * _POWERS[1:-1] * powers[:-2]))
        c = self.coefficients
        return PathPoint(powers @ c, first @ c, second @ c)


def linear(start: float, duration: float, begin: Array, end: Array) -> Segment:
    """Return the straight segment between two positions.

    Args:
        start: When it begins in [s].
        duration: How long it lasts in [s].
        begin: Positions at its begin in [rad].
        end: Positions at its end in [rad].
    """
    coefficients = np.zeros((6, len(begin)))
    coefficients[0], coefficients[1] = begin, (end - begin) / duration
    return Segment(start, duration, coefficients)


def cubic(start: float, duration: float, begin: PathPoint, end: PathPoint) -> Segment:
    """Return the cubic that meets positions and velocities at both ends.

    Args:
        start: When it begins in [s].
        duration: How long it lasts in [s].
        begin: Its begin; the acceleration is not used.
        end: Its end; the acceleration is not used.
    """
    t, way = duration, end.position - begin.position
    coefficients = np.zeros((6, len(way)))
    coefficients[0], coefficients[1] = begin.position, begin.velocity
    coefficients[2] = (3 * way / t - 2 * begin.velocity - end.velocity) / t
    coefficients[3] = (-2 * way / t + begin.velocity + end.velocity) / t**2
    return Segment(start, duration, coefficients)


def quintic(start: float, duration: float, begin: PathPoint, end: PathPoint) -> Segment:
    """Return the quintic that meets positions, velocities and accelerations at both ends.

    Args:
        start: When it begins in [s].
        duration: How long it lasts in [s].
        begin: Its begin.
        end: Its end.
    """
    t = duration
    way = end.position - begin.position - (begin.velocity + 0.5 * begin.acceleration * t) * t
    gain = (end.velocity - begin.velocity - begin.acceleration * t) * t
    bend = (end.acceleration - begin.acceleration) * t**2
    coefficients = np.zeros((6, len(way)))
    coefficients[0], coefficients[1] = begin.position, begin.velocity
    coefficients[2] = 0.5 * begin.acceleration
    coefficients[3] = (10 * way - 4 * gain + 0.5 * bend) / t**3
    coefficients[4] = (-15 * way + 7 * gain - bend) / t**4
    coefficients[5] = (6 * way - 3 * gain + 0.5 * bend) / t**5
    return Segment(start, duration, coefficients)


class Path:
    """Segments one after the other.

    Attributes:
        segments: The segments, without gaps.
        duration: How long all of it lasts in [s].
        end: Its last place; beyond it the arm rests there.
        joined: Whether it begins with the velocity and acceleration that the arm has.
    """

    def __init__(self, segments: Sequence[Segment], joined: bool = False) -> None:
        """Join segments.

        Args:
            segments: At least one; each begins where and when the one before ends.
            joined: Whether it begins with the velocity and acceleration that the arm has.
        """
        self.joined = joined
        self.segments = tuple(segments)
        self._starts = [segment.start for segment in self.segments]
        self._coefficients = np.array([segment.coefficients for segment in self.segments])
        last = self.segments[-1]
        self.duration = last.start + last.duration
        self.end = last.at(self.duration)

    def at(self, time: float) -> PathPoint:
        """Return the place at a time of the path in [s]; beyond its end it rests there."""
        if time > self.duration:
            rest = np.zeros(len(self.end.position))
            return PathPoint(self.end.position, rest, rest)
        place = max(0, bisect_right(self._starts, time) - 1)
        return self.segments[place].at(max(time, 0.0))

    def positions(self, times: Array) -> Array:
        """Return the positions (k, n) in [rad] at times of the path (k) in [s]."""
        within = np.clip(times, 0.0, self.duration)
        places = np.maximum(np.searchsorted(self._starts, within, side='right') - 1, 0)
        powers = (within - np.array(self._starts)[places])[:, None] ** _POWERS
        positions: Array = np.einsum('kp,kpn->kn', powers, self._coefficients[places])
        return positions


def rounded(path: Path, limits: JointLimits) -> Path:
    """Round the corners of a path, its begin and its end among them.

    Where velocity or acceleration jump by D or E, the path goes over smoothly within a time 2 d
    that keeps the peaks 3/4 D/d of acceleration, 3/2 D/d^2 and 9/8 E/d of jerk within the limits,
    where the segments are long enough. It leaves a corner of straight segments by 3/16 D d,
    and is back on the path at the times that this says. Where it does not begin or end at rest it
    is given the time for that: it gets longer by d there.

    Args:
        path: Segments, of which neighbours may meet in a corner.
        limits: Limits of the joints.
    """
    segments = _with_rests(path, limits)
    halves = [_half(a, b, limits) for a, b in pairwise(segments)]
    out: list[Segment] = []
    begin = segments[0].start
    for segment, half, following in zip_longest(segments, halves, segments[1:]):
        end, blend = segment.start + segment.duration, half or 0.0
        room = end - blend - begin
        if room > 1e-9:
            out.append(_part(segment, begin, room))
        if blend > 0.0:
            ends = (segment.at(end - blend), following.at(end + blend))
            out.append(quintic(end - blend, 2 * blend, *ends))
        begin = end + blend
    return Path(_from_zero(out))


def with_run_out(path: Path, limits: JointLimits) -> Path:
    """Let a path that ends with a velocity come to rest behind its end.

    Args:
        path: The path.
        limits: Limits of the joints.
    """
    end = path.end
    still = np.zeros_like(end.velocity)
    duration = 2.0 * _needed(np.abs(end.velocity), still, limits)
    if duration == 0.0:
        return path
    behind = PathPoint(end.position + 0.5 * duration * end.velocity, still, still)
    out = quintic(path.duration, duration, PathPoint(end.position, end.velocity, still), behind)
    return Path([*path.segments, out])


def _with_rests(path: Path, limits: JointLimits) -> list[Segment]:
    """Put a rest in front of a path that begins with a jump, and behind one that ends so."""
    segments = list(path.segments)
    first, last = segments[0], segments[-1]
    begin, end = first.at(first.start), path.end
    half = _needed(np.abs(begin.velocity), np.abs(begin.acceleration), limits)
    if half > 0.0 and not path.joined:
        segments.insert(0, _rest(first.start - half, half, begin.position))
    half = _needed(np.abs(end.velocity), np.abs(end.acceleration), limits)
    if half > 0.0:
        segments.append(_rest(last.start + last.duration, half, end.position))
    return segments


def _rest(start: float, duration: float, position: Array) -> Segment:
    coefficients = np.zeros((6, len(position)))
    coefficients[0] = position
    return Segment(start, duration, coefficients)


def _needed(jump: Array, bend: Array, limits: JointLimits) -> float:
    """Return half the time that jumps of velocity and acceleration need in [s], 0 for none."""
    if (
        max(float(np.max(jump / limits.velocity)), float(np.max(bend / limits.acceleration)))
        < 1e-6
    ):
        return 0.0
    by_acceleration = float(np.max(0.75 * jump / limits.acceleration))
    by_jerk = float(np.max(np.sqrt(1.5 * jump / limits.jerk)))
    by_bend = float(np.max(1.125 * bend / limits.jerk))
    return max(ROOM * max(by_acceleration, by_jerk, by_bend), BRIEFEST)


def _half(first: Segment, second: Segment, limits: JointLimits) -> float:
    """Return half the time of the blend between two segments in [s]; 0 without a corner."""
    corner = first.start + first.duration
    before, after = first.at(corner), second.at(corner)
    jump = np.abs(after.velocity - before.velocity)
    bend = np.abs(after.acceleration - before.acceleration)
    room = [s.duration if _resting(s) else s.duration / 2 for s in (first, second)]
    return min(_needed(jump, bend, limits), *room)


def _resting(segment: Segment) -> bool:
    return not segment.coefficients[1:].any()


def _part(segment: Segment, start: float, duration: float) -> Segment:
    """Return a part of a segment."""
    return quintic(start, duration, segment.at(start), segment.at(start + duration))


def _from_zero(segments: Sequence[Segment]) -> list[Segment]:
    """Move segments in time so that the first begins at zero."""
    shift = segments[0].start
    return [Segment(each.start - shift, each.duration, each.coefficients) for each in segments]
