# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Joint-space paths as piecewise polynomials over trajectory time, and contact on them.

Trajectory time differs from clock time: :class:`TrajectoryTimer` can follow a path slower, stop
on it and continue. Velocities and accelerations on a path are derivatives with respect to
trajectory time.

:class:`PathCheck` finds contact on a path before execution. It samples the path so that no link
moves by more than :data:`MAX_STEP` relative to another between samples, so a missed contact is
shallower than that. It measures distances only where the distance rate bounds of the planning
scene do not prove that a pair is clear.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence
from dataclasses import dataclass
import math

import numpy as np

from arm_model import Array, Clearances, Places, PlanningScene, RobotState

# d^k/dt^k of the powers 0 to 5, as factors and exponents
_POWERS = np.arange(6.0)

# Bezier control values on 0..1 from coefficients: Farin, "Curves and Surfaces for CAGD"
_BERNSTEIN = np.array(
    [[math.comb(row, p) / math.comb(5, p) for p in range(6)] for row in range(6)]
)

# binomial coefficients for shifting a polynomial: row power from column power
_BINOMIAL = np.array([[math.comb(column, row) for column in range(6)] for row in range(6)])


ROUNDING_TOLERANCE = 1e-6  # tolerated rounding in [rad]


def shifted(coefficients: Array, by: Array) -> Array:
    """Return polynomials (k, 6, n) or (6, n) with their origin moved later by ``by`` [s] (k)."""
    powers = by[:, None, None] ** np.maximum(_POWERS - _POWERS[:, None], 0.0)
    moved: Array = (_BINOMIAL * powers) @ coefficients
    return moved


def lines(durations: Array, positions: Array) -> Array:
    """Return the coefficients (k, 6, n) of straight motions between positions (k + 1, n) [rad]."""
    pieces = np.zeros((len(durations), 6, positions.shape[1]))
    pieces[:, 0] = positions[:-1]
    pieces[:, 1] = np.diff(positions, axis=0) / durations[:, None]
    return pieces


def cubics(durations: Array, positions: Array, velocities: Array) -> Array:
    """Return the coefficients (k, 6, n) of the cubics between successive points (k + 1, n).

    Positions are in [rad], velocities in [rad/s].
    """
    pieces = lines(durations, positions)
    t, slope, first, last = (
        durations[:, None],
        pieces[:, 1].copy(),
        velocities[:-1],
        velocities[1:],
    )
    pieces[:, 1] = first
    pieces[:, 2] = (3.0 * slope - 2.0 * first - last) / t
    pieces[:, 3] = (-2.0 * slope + first + last) / t**2
    return pieces


def quintics(durations: Array, positions: Array, velocities: Array, accelerations: Array) -> Array:
    """Return the coefficients (k, 6, n) of the quintics between successive points (k + 1, n).

    Positions are in [rad], velocities in [rad/s], accelerations in [rad/s2].
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


class Path:
    """Sequence of polynomial segments of at most fifth degree.

    Attributes:
        starts: Start times of the segments in [s] (k).
        durations: Durations of the segments in [s] (k).
        coefficients: For powers 0 to 5 of the time since the segment start (k, 6, n).
        duration: Total duration in [s].
        end: Final state; after it the arm rests there.
    """

    def __init__(self, durations: Array, coefficients: Array) -> None:
        self.durations, self.coefficients = durations, coefficients
        self.starts: Array = np.concatenate(((0.0,), np.cumsum(durations)[:-1]))
        self._starts = self.starts.tolist()  # bisect is quicker on a list
        self.duration = float(self.starts[-1] + durations[-1])
        self.end = self._state(-1, self.duration - self._starts[-1])

    @classmethod
    def between(cls, duration: float, begin: RobotState, end: RobotState) -> Path:
        """Return the quintic with given position, velocity and acceleration at both ends."""
        ends = (
            np.array((getattr(begin, name), getattr(end, name)))
            for name in ('position', 'velocity', 'acceleration')
        )
        lasts = np.array([duration])
        return cls(lasts, quintics(lasts, *ends))

    @classmethod
    def joined(cls, paths: Sequence[Path]) -> Path:
        """Concatenate paths, each of which begins where the previous one ends."""
        return cls(
            np.concatenate([each.durations for each in paths]),
            np.concatenate([each.coefficients for each in paths]),
        )

    def part(self, begin: float, end: float) -> Path:
        """Return the part of the path between two times in [s], exactly."""
        inner = self.starts[(self.starts > begin) & (self.starts < end)]
        times = np.concatenate(((begin,), inner, (end,)))
        return Path(np.diff(times), self.cut(times))

    def cut(self, times: Array) -> Array:
        """Return the coefficients (k, 6, n) of the parts between times in [s] (k + 1)."""
        middles = 0.5 * (times[:-1] + times[1:])
        numbers = np.searchsorted(self.starts, middles, side='right') - 1
        return shifted(self.coefficients[numbers], times[:-1] - self.starts[numbers])

    @property
    def control_values(self) -> Array:
        """Bezier control values (k, 6, n) of the segments, whose hull contains the positions."""
        scaled = self.coefficients * (self.durations[:, None] ** _POWERS)[:, :, None]
        control: Array = np.einsum('cp,kpn->kcn', _BERNSTEIN, scaled)
        return control

    def at(self, time: float) -> RobotState:
        """Return the state at a path time in [s]; after the end, at rest there."""
        if time > self.duration:
            rest = np.zeros(len(self.end.position))
            return RobotState(self.end.position, rest, rest)
        place = max(0, bisect_right(self._starts, time) - 1)
        return self._state(place, max(time, 0.0) - self._starts[place])

    def positions(self, times: Array) -> Array:
        """Return the positions (k, n) in [rad] at path times (k) in [s]."""
        within = np.clip(times, 0.0, self.duration)
        places = np.maximum(np.searchsorted(self.starts, within, side='right') - 1, 0)
        return self.derived(0, places, within - self.starts[places])

    def _state(self, number: int, t: float) -> RobotState:
        """Return the state at a time in [s] since the start of a segment."""
        powers = t**_POWERS
        first = np.concatenate(((0.0,), _POWERS[1:] * powers[:-1]))
        second = np.concatenate(((0.0, 0.0), _POWERS[2:] * _POWERS[1:-1] * powers[:-2]))
        c = self.coefficients[number]
        return RobotState(powers @ c, first @ c, second @ c)

    def derived(self, order: int, places: Places, times: Array) -> Array:
        """Return a derivative (m, n) of segments (m) at times (m) in [s] since their start.

        Order 0 is the position in [rad].
        """
        count = self.coefficients.shape[1]
        powers = np.vander(times, count - order, increasing=True)
        factors = [math.perm(power, order) for power in range(order, count)]
        rows = self.coefficients[places, order:]
        derived: Array = np.einsum('mp,mpn->mn', powers * factors, rows)
        return derived


@dataclass(frozen=True, slots=True)
class Excess:
    """Point on a path that exceeds a position range."""

    joint: int  # number of the joint
    position: float  # where it is in [rad]
    time: float  # when on the path in [s]


def farthest_beyond(path: Path, lower: Array, upper: Array) -> Excess | None:
    """Return the point where a path exceeds a range the most; None if it stays within."""
    scaled = path.coefficients * (path.durations[:, None] ** np.arange(6.0))[:, :, None]
    control = path.control_values
    too_low = (control < lower - ROUNDING_TOLERANCE).any(axis=1)
    too_high = (control > upper + ROUNDING_TOLERANCE).any(axis=1)
    outside = too_low | too_high
    worst, most = None, ROUNDING_TOLERANCE
    for place, joint in np.argwhere(outside).tolist():
        for share, position in _extremes(scaled[place, :, joint]):
            beyond = max(lower[joint] - position, position - upper[joint])
            if beyond > most:
                most = beyond
                time = path.starts[place] + share * path.durations[place]
                worst = Excess(joint, position, float(time))
    return worst


def _extremes(coefficients: Array) -> list[tuple[float, float]]:
    """Return (argument, value) at the ends and turning points of a polynomial on 0..1."""
    slopes = coefficients[1:] * np.arange(1.0, 6.0)
    turning = np.roots(slopes[::-1])
    inner = turning.real[
        (np.abs(turning.imag) < ROUNDING_TOLERANCE) & (turning.real > 0) & (turning.real < 1)
    ]
    shares = [0.0, *inner.tolist(), 1.0]
    return [(share, float(np.polyval(coefficients[::-1], share))) for share in shares]


MAX_STEP = 0.005  # greatest relative motion of two links between samples in [m]
COARSE_PERIOD = 0.01  # sampling period from which the steps are computed in [s]
MAX_SAMPLES = 50_000  # most samples of a path: beyond 250 m of motion they are farther apart
MAX_BATCH = 64  # most samples that are proven clear at once

CONTACT_TOLERANCE = 1e-4
"""Tolerated overlap in [m] for rounding; for links already in contact, tolerated increase."""


@dataclass(frozen=True, slots=True)
class PathContact:
    """First contact of two links, or of a link and an object, on a path."""

    links: tuple[str, str]  # their names
    time: float  # when they meet in [s]


class PathCheck:
    """Finds contact of links on paths; use it in one thread."""

    def __init__(self, scene: PlanningScene) -> None:  # ``model.scene`` is the arm alone
        self._scene, self._clearances = scene, Clearances(scene)

    def contact(
        self, positions_at: Callable[[Array], Array], duration: float
    ) -> PathContact | None:
        """Return the first contact on a path; None if it is clear.

        Links that start in contact may separate, but must not come nearer.

        Args:
            positions_at: Function from times in [s] (k) to joint positions in [rad] (k, n).
        """
        if not self._scene.pairs:
            return None
        times = self._looks(positions_at, duration)
        rows = positions_at(times)
        floor = np.full(len(self._scene.pairs), -np.inf)
        place, ahead = 0, 1
        while place < len(rows):
            passed = self._clearances.provably_clear(rows[place : place + ahead], 0.0)
            if passed:
                floor.fill(-CONTACT_TOLERANCE)
                place, ahead = place + passed, min(2 * ahead, MAX_BATCH)
                continue
            distances = self._clearances.least(rows[place], 0.0)
            deeper = distances < floor
            if deeper.any():
                links = self._scene.pairs[int(deeper.argmax())]
                return PathContact(links, float(times[place]))
            floor = np.maximum(floor, np.minimum(distances, 0.0) - CONTACT_TOLERANCE)
            place, ahead = place + 1, 1
        return None

    def _looks(self, positions_at: Callable[[Array], Array], duration: float) -> Array:
        """Return the sample times, dense where the arm moves fast."""
        coarse = np.linspace(0.0, duration, math.ceil(duration / COARSE_PERIOD) + 2)
        turns = np.abs(np.diff(positions_at(coarse), axis=0))
        motion = (turns @ self._scene.distance_rate_bounds.T).max(axis=1)
        along = np.concatenate(((0.0,), np.cumsum(motion)))
        count = min(math.ceil(along[-1] / MAX_STEP), MAX_SAMPLES)
        times: Array = np.interp(np.linspace(0.0, along[-1], count + 1), along, coarse)
        return times
