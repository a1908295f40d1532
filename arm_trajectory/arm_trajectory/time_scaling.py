# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Time scaling: slows a path down where joints could not follow; its geometry stays the same.

It runs once before execution, like TOPP-RA, but with limited jerk, and never makes a path faster
than its points. During execution, the speed scaling of :mod:`.execution` takes over.

Planners limit velocity and acceleration, seldom jerk, and only at their points; the demand between
points may be higher. The path q(s) is followed as q(s(t)) with ds/dt = 1/r. The scaling r(s) >= 1
is a cubic B-spline, so acceleration stays continuous. By the chain rule, with u = 1/r and primes
for derivatives by s, the demand is::

    velocity      q' u
    acceleration  q'' u^2 + q' u u'
    jerk          q''' u^3 + 3 q'' u^2 u' + q' u (u'^2 + u u'')

Where it exceeds a limit, the spline coefficients are increased until all limits hold.
"""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from arm_model import Array, JointLimits, Places

from .path import Path, quintics

MAX_SPACING = 0.01  # greatest distance between samples in [s]
MAX_SAMPLES = 4000  # approximate number of samples of a path: long ones are sampled less densely
MIN_SEGMENT_SAMPLES = 4  # least number of sample intervals of each segment

KNOT_SPACINGS = (0.06, 0.15, 0.4)
"""Knot spacings of the spline in [s] that are tried: short ones lose less time."""

MAX_ITERATIONS = 60  # greatest number of iterations of the spline

LIMIT_FACTORS = (0.99, 0.96, 0.9)
"""Shares of the limits to aim for, tried until the path between samples is within, too."""

BETWEEN_FACTORS = (1.0, 1.01, 1.03)
"""Factors by which velocity, acceleration and jerk may be greater between samples."""

INTEGRAL = np.array([1.0, 11.0, 11.0, 1.0]) / 24.0
"""Integrals of the four basis functions of a uniform cubic B-spline over a cell of width 1."""

MAX_SEGMENT_DURATION = 0.02  # greatest length of the new segments in [s] of the given path


@dataclass(frozen=True, slots=True, eq=False)
class Demand:
    """Greatest demand of a path on a joint."""

    # factor of time that is needed to meet the limits; at most 1 if they are met
    time_factor: float
    joint: int  # index of the joint
    quantity: int  # 0 velocity, 1 acceleration, 2 jerk
    time: float  # when in [s]
    value: float  # how much in [rad/s], [rad/s2] or [rad/s3]


class Timing:
    """Demand of a path on the joints, and the scaling that brings it within their limits."""

    def __init__(self, path: Path, limits: JointLimits) -> None:
        self._path = path
        self._limits = limits
        places, offsets = _places(path)
        self._times: Array = path.starts[places] + offsets
        self._rates = [path.derived(order, places, offsets) for order in (1, 2, 3)]

    @property
    def fastest(self) -> Demand:
        """The greatest velocity demand of the path, relative to the limits."""
        return self._most(self._time_factors(self._rates, 1.0)[:1])

    @property
    def demand(self) -> Demand:
        """The greatest demand of the path, relative to the limits."""
        return self._most(self._time_factors(self._rates, 1.0))

    @property
    def plainest(self) -> Demand:
        """The plainest excess demand: of velocity, else acceleration, else jerk."""
        factors = self._time_factors(self._rates, 1.0)
        beyond = [row for row in range(3) if factors[row].max() > 1.0]
        return self._most(factors[: beyond[0] + 1]) if beyond else self._most(factors)

    def _most(self, factors: Array) -> Demand:
        quantity, place, joint = np.unravel_index(int(factors.argmax()), factors.shape)
        value = float(abs(self._rates[quantity][place, joint]))
        return Demand(
            float(factors.max()), int(joint), int(quantity), float(self._times[place]), value
        )

    def time_scaled(self) -> Path | None:
        """Return the fastest spline-scaled path within the limits; None if there is none."""
        if self.demand.time_factor <= 1.0:
            return self._path
        for full in LIMIT_FACTORS:
            found = [
                each for knots in KNOT_SPACINGS if (each := self._solved(knots, full)) is not None
            ]
            if not found:
                return None
            path = _scaled_path(self._path, min(found, key=lambda scaling: scaling.duration))
            if Timing(path, self._limits).demand.time_factor <= 1.0:
                return path
        return None

    def _solved(self, knots: float, full: float) -> TimeScaling | None:
        """Return a scaling with knots spaced by about ``knots`` in [s]; None if not found."""
        count = max(math.ceil(self._path.duration / knots), 1)
        scaling = TimeScaling(np.ones(count + 3), self._path.duration)
        cells, basis = scaling.basis(self._times)
        for _ in range(MAX_ITERATIONS):
            r, slope, bend = scaling.derived(cells, basis)
            needed = self._needed(r, slope, bend, full)
            if needed.max() <= 1.0:
                return scaling
            most = np.ones(count)
            np.maximum.at(most, cells, needed)
            wide = np.concatenate((np.ones(3), most, np.ones(3)))
            growth = np.max([wide[shift : shift + count + 3] for shift in range(4)], axis=0)
            scaling = TimeScaling(scaling.coefficients * growth, scaling.length)
        return None

    def _needed(self, r: Array, slope: Array, bend: Array, full: float) -> Array:
        """Return the greatest time factor needed at each sample under a scaling."""
        u = 1.0 / r
        first = -slope * u**2
        second = (2.0 * slope**2 * u - bend) * u**2
        rate, change, jolt = u, u * first, u * (first**2 + u * second)
        speed, acceleration, jerk = self._rates
        scaled = [
            speed * rate[:, None],
            acceleration * (rate**2)[:, None] + speed * change[:, None],
            jerk * (rate**3)[:, None]
            + 3.0 * acceleration * (rate * change)[:, None]
            + speed * jolt[:, None],
        ]
        speed, acceleration, jerk = (each.max(axis=1) for each in self._shares(scaled, full))
        needed: Array = np.maximum(np.maximum(speed, np.sqrt(acceleration)), np.cbrt(jerk))
        return needed

    def _time_factors(self, rates: list[Array], full: float) -> Array:
        """Return the time factors (3, m, n) needed for velocity, acceleration and jerk."""
        speed, acceleration, jerk = self._shares(rates, full)
        return np.array((speed, np.sqrt(acceleration), np.cbrt(jerk)))

    def _shares(self, rates: list[Array], full: float) -> list[Array]:
        """Return velocity, acceleration and jerk (m, n) as shares of the allowed values."""
        limits = self._limits
        most = (limits.velocity, limits.acceleration, limits.jerk)
        return [
            np.abs(rate) * (more / full / limit)
            for rate, more, limit in zip(rates, BETWEEN_FACTORS, most, strict=True)
        ]


class TimeScaling:
    """Cubic B-spline of the time scaling r over path time, in seconds per second."""

    def __init__(self, coefficients: Array, length: float) -> None:
        self.coefficients = coefficients
        self.length = length
        self._width = length / (len(coefficients) - 3)

    @property
    def duration(self) -> float:
        """Duration of the scaled path in [s]."""
        cells = np.convolve(self.coefficients, INTEGRAL, 'valid')
        return float(self._width * cells.sum())

    def basis(self, times: Array) -> tuple[Places, Array]:
        """Return the cells (m) of times, and the weights of their coefficients (3, m, 4)."""
        last = len(self.coefficients) - 4
        cells = np.clip((times / self._width).astype(int), 0, last)
        f = times / self._width - cells
        g, h = 1.0 - f, self._width
        f2, g2 = f * f, g * g
        value = (g * g2, (3 * f - 6) * f2 + 4, (3 * g - 6) * g2 + 4, f * f2)
        slope = (-g2, 3 * f2 - 4 * f, 4 * g - 3 * g2, f2)
        bend = (g, 3 * f - 2, 3 * g - 2, f)
        scales = np.array([1 / 6, 0.5 / h, 1 / h**2])
        return cells, np.array([value, slope, bend]).transpose(0, 2, 1) * scales[:, None, None]

    def derived(self, cells: Places, weights: Array) -> Array:
        """Return the spline or its derivatives (..., m), from weights of :meth:`basis`."""
        near = self.coefficients[cells[:, None] + np.arange(4)]
        derived: Array = np.einsum('mj,...mj->...m', near, weights)
        return derived

    def times(self, places: Array) -> Array:
        """Convert path times, starting at 0, to scaled times in [s]."""
        knots = np.arange(1, len(self.coefficients) - 3) * self._width
        fine = np.unique(np.concatenate((places, knots)))
        middle, half = 0.5 * (fine[:-1] + fine[1:]), 0.5 * np.diff(fine)
        ways = np.zeros(len(half))
        for root in (-math.sqrt(1 / 3), math.sqrt(1 / 3)):  # Gauss: exact for cubics
            cells, basis = self.basis(middle + root * half)
            ways = ways + half * self.derived(cells, basis[0])
        along = np.concatenate(((0.0,), np.cumsum(ways)))
        times: Array = along[np.searchsorted(fine, places)]
        return times


def _places(path: Path) -> tuple[Places, Array]:
    """Return segment numbers of the samples of a path, and their times in the segments in [s]."""
    spacing = max(MAX_SPACING, path.duration / MAX_SAMPLES)
    lasts = path.durations
    counts = np.maximum(np.ceil(lasts / spacing).astype(int), MIN_SEGMENT_SAMPLES) + 1
    places = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(places)) - np.repeat(np.cumsum(counts) - counts, counts)
    return places, lasts[places] * number / (counts[places] - 1)


def _scaled_path(path: Path, scaling: TimeScaling) -> Path:
    """Return a path with the scaling applied."""
    lasts = path.durations
    counts = np.ceil(lasts / MAX_SEGMENT_DURATION).astype(int)
    places = np.repeat(np.arange(len(counts)), counts)
    number = np.arange(len(places)) - np.repeat(np.cumsum(counts) - counts, counts)
    offsets = lasts[places] * number / counts[places]
    places, offsets = np.append(places, len(counts) - 1), np.append(offsets, lasts[-1])
    given = path.starts[places] + offsets
    cells, basis = scaling.basis(given)
    r, slope = scaling.derived(cells, basis[:2])
    q, speed, bend = (path.derived(order, places, offsets) for order in range(3))
    velocity = speed / r[:, None]
    acceleration = bend / (r**2)[:, None] - speed * (slope / r**3)[:, None]
    lengths = np.diff(scaling.times(given))
    return Path(lengths, quintics(lengths, q, velocity, acceleration))
