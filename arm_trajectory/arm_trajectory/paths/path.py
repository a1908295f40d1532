# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Paths in joint space: polynomials over the time of a trajectory.

The time of the trajectory is not that of the clock: :class:`TrajectoryTimer` follows a path
slower, stops on it and goes on. Velocities and accelerations of a place on a path are derivatives
by the path's own time.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass, replace
import math

import numpy as np

from arm_model import Array, Places, RobotState

# d^k/dt^k of the powers 0 to 5, as factors and exponents
_POWERS = np.arange(6.0)

# control values of a polynomial on 0..1 by its coefficients: Farin, "Curves and Surfaces for CAGD"
_BERNSTEIN = np.array(
    [[math.comb(row, p) / math.comb(5, p) for p in range(6)] for row in range(6)]
)

# how often the power of the row comes out of that of the column when a polynomial is moved
_BINOMIAL = np.array([[math.comb(column, row) for column in range(6)] for row in range(6)])


@dataclass(frozen=True, slots=True, eq=False)
class Segment:
    """A polynomial of at most fifth degree."""

    start: float  # when it begins in [s]
    duration: float  # how long it lasts in [s]
    coefficients: Array  # of the powers 0 to 5 of the time since its start (6, n)

    def at(self, time: float) -> RobotState:
        """Return the place at a time of the path in [s]."""
        t = time - self.start
        powers = t**_POWERS
        first = np.concatenate(((0.0,), _POWERS[1:] * powers[:-1]))
        second = np.concatenate(((0.0, 0.0), _POWERS[2:] * _POWERS[1:-1] * powers[:-2]))
        c = self.coefficients
        return RobotState(powers @ c, first @ c, second @ c)


def shifted(coefficients: Array, by: Array) -> Array:
    """Return the coefficients of polynomials (k, 6, n) whose times begin later.

    Args:
        coefficients: Those of the polynomials (k, 6, n), or of one for all (6, n).
        by: How much later in [s] (k).
    """
    powers = by[:, None, None] ** np.maximum(_POWERS - _POWERS[:, None], 0.0)
    moved: Array = (_BINOMIAL * powers) @ coefficients
    return moved


def linear(start: float, duration: float, begin: Array, end: Array) -> Segment:
    """Return the straight segment between two positions."""
    coefficients = np.zeros((6, len(begin)))
    coefficients[0], coefficients[1] = begin, (end - begin) / duration
    return Segment(start, duration, coefficients)


def cubic(start: float, duration: float, begin: RobotState, end: RobotState) -> Segment:
    """Return the cubic that meets positions and velocities at both ends.

    Args:
        begin: Its begin; the acceleration is not used.
    """
    t, way = duration, end.position - begin.position
    coefficients = np.zeros((6, len(way)))
    coefficients[0], coefficients[1] = begin.position, begin.velocity
    coefficients[2] = (3 * way / t - 2 * begin.velocity - end.velocity) / t
    coefficients[3] = (-2 * way / t + begin.velocity + end.velocity) / t**2
    return Segment(start, duration, coefficients)


def quintic(start: float, duration: float, begin: RobotState, end: RobotState) -> Segment:
    """Return the quintic that meets positions, velocities and accelerations at both ends."""
    ends = (np.array(pair) for pair in zip(_fields(begin), _fields(end), strict=True))
    return Segment(start, duration, quintics(np.array([duration]), *ends)[0])


def quintics(durations: Array, positions: Array, velocities: Array, accelerations: Array) -> Array:
    """Return the coefficients (k, 6, n) of the quintics from each place to the next.

    Args:
        positions: Positions in [rad] (k + 1, n).
        velocities: Velocities in [rad/s] (k + 1, n).
        accelerations: Accelerations in [rad/s2] (k + 1, n).
    """
    t, p, v, a = durations[:, None], positions[:-1], velocities[:-1], accelerations[:-1]
    way = positions[1:] - p - (v + 0.5 * a * t) * t
    gain = (velocities[1:] - v - a * t) * t
    bend = (accelerations[1:] - a) * t**2
    rows = (
        p,
        v,
        0.5 * a,
        (10 * way - 4 * gain + 0.5 * bend) / t**3,
        (-15 * way + 7 * gain - bend) / t**4,
        (6 * way - 3 * gain + 0.5 * bend) / t**5,
    )
    return np.stack(rows, axis=1)


def _fields(point: RobotState) -> tuple[Array, Array, Array]:
    return point.position, point.velocity, point.acceleration


class Path:
    """Segments one after the other.

    Attributes:
        segments: The segments, without gaps.
        starts: When they begin in [s] (k).
        coefficients: Their coefficients (k, 6, n).
        duration: How long all of it lasts in [s].
        end: Its last place; beyond it the arm rests there.
    """

    def __init__(self, segments: Sequence[Segment]) -> None:
        """Join segments.

        Args:
            segments: At least one; each begins where and when the one before ends.
        """
        self.segments = tuple(segments)
        self._starts = [segment.start for segment in self.segments]  # bisect is quicker on a list
        self.starts: Array = np.array(self._starts)
        self.coefficients: Array = np.array([each.coefficients for each in self.segments])
        last = self.segments[-1]
        self.duration = last.start + last.duration
        self.end = last.at(self.duration)

    @classmethod
    def of(cls, durations: Array, coefficients: Array) -> Path:
        """Return polynomials (k, 6, n) one after the other, of durations in [s] (k)."""
        starts = np.concatenate(((0.0,), np.cumsum(durations)[:-1]))
        rows = zip(starts.tolist(), durations.tolist(), coefficients, strict=True)
        return cls([Segment(*each) for each in rows])

    @property
    def control_values(self) -> Array:
        """Control values of the segments' positions (k, 6, n), in whose hull they lie."""
        scaled = self.coefficients * (self.durations[:, None] ** _POWERS)[:, :, None]
        control: Array = np.einsum('cp,kpn->kcn', _BERNSTEIN, scaled)
        return control

    def followed_by(self, segments: Sequence[Segment]) -> Path:
        """Return it with the segments of another path, which begins at 0, behind its end."""
        later = (replace(each, start=self.duration + each.start) for each in segments)
        return Path([*self.segments, *later])

    def at(self, time: float) -> RobotState:
        """Return the place at a time of the path in [s]; beyond its end it rests there."""
        if time > self.duration:
            rest = np.zeros(len(self.end.position))
            return RobotState(self.end.position, rest, rest)
        place = max(0, bisect_right(self._starts, time) - 1)
        return self.segments[place].at(max(time, 0.0))

    def positions(self, times: Array) -> Array:
        """Return the positions (k, n) in [rad] at times of the path (k) in [s]."""
        within = np.clip(times, 0.0, self.duration)
        places = np.maximum(np.searchsorted(self.starts, within, side='right') - 1, 0)
        return self.derived(0, places, within - self.starts[places])

    @property
    def durations(self) -> Array:
        """How long the segments last in [s] (k)."""
        lasts: Array = np.array([segment.duration for segment in self.segments])
        return lasts

    def derived(self, order: int, places: Places, times: Array) -> Array:
        """Return a derivative (m, n) by the path's time.

        Args:
            order: How often to derive: 0 is the position in [rad].
            places: Numbers of the segments (m).
            times: Times since their begin in [s] (m).
        """
        count = self.coefficients.shape[1]
        powers = np.vander(times, count - order, increasing=True)
        factors = [math.perm(power, order) for power in range(order, count)]
        rows = self.coefficients[places, order:]
        derived: Array = np.einsum('mp,mpn->mn', powers * factors, rows)
        return derived
