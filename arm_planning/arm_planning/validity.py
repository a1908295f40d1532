# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether an arm may be somewhere, or follow a path: limits of position, and contact.

A path is laid out in places between which no shape moves by more than twice :data:`MARGIN`
against another. A pair that is measured at one of them stays apart for as long as its shapes
cannot have moved by its distance, by the scene's distance rate bounds; there it is measured again,
and must have :data:`MARGIN` left. So nothing touches between two places either, and pairs that are
far apart are measured a few times on the whole path.

Where start or goal are nearer to contact than that, the pair may be as near on the way as it is
there, and the places are denser; a contact of less than :data:`MIN_MARGIN` can then remain.
"""

from __future__ import annotations

from dataclasses import dataclass
from heapq import heappop, heappush
import math

import numpy as np
import pinocchio as pin

from arm_model import Array, Clearances, Contact, JointLimits, Places, PlanningScene
from arm_trajectory import Path

MARGIN = 1e-3
"""Distance that every pair keeps on a path in [m]."""

MIN_MARGIN = 1e-4
"""The same where start or goal are nearer to contact in [m]."""

LIMIT_TOLERANCE = 1e-6
"""How far a position may be beyond a limit, for rounding, in [rad]."""

DEGREE = 5
"""Of the polynomials of a path."""


@dataclass(frozen=True, slots=True, eq=False)
class Violation:
    """Why a state or a path is not valid.

    Attributes:
        reason: In words: the joint and its limit, or the bodies, how deep and where.
        positions: Joint positions there in [rad].
        contact: The deepest contact; None where a limit is the matter or bodies are only near.
        time: When on the path in [s]; 0 for a state.
    """

    reason: str
    positions: Array
    contact: Contact | None = None
    time: float = 0.0


class ValidityCheck:
    """Checks states and paths in one scene; belongs to one thread."""

    def __init__(self, limits: JointLimits, scene: PlanningScene) -> None:
        """Prepare.

        Args:
            limits: Limits of the joints.
            scene: What may collide.
        """
        self._limits = limits
        self._clearances = Clearances(scene)
        self._data = scene.kinematics.native.createData()
        self._results = scene.geometry.createData()

    @property
    def scene(self) -> PlanningScene:
        """The scene that is measured."""
        return self._clearances.scene

    def state(self, positions: Array) -> Violation | None:
        """Return why the arm may not be somewhere; None where it may.

        Args:
            positions: Joint positions in [rad] (n).
        """
        return self._beyond(positions, positions, 0.0) or self._touching(positions, 0.0)

    def least_margin(self, positions: Array) -> float:
        """Return the distance that every pair has, :data:`MARGIN` at most, in [m].

        Args:
            positions: Joint positions in [rad] (n).
        """
        return float(self._clearances.least(positions, MARGIN).min(initial=MARGIN))

    def waypoints(self, places: Array) -> Violation | None:
        """Return what is wrong with the straight lines between places; None for nothing.

        Args:
            places: Joint positions in [rad] (m, n).
        """
        lower, upper = places.min(axis=0), places.max(axis=0)
        if (beyond := self._beyond(lower, upper, 0.0)) is not None:
            return beyond
        required, spacing = self._required(places[0], places[-1])
        motions = self._motions(np.abs(np.diff(places, axis=0)))
        counts = np.ceil(motions / spacing).astype(int) + 1
        segments, shares = _laid_out(counts)
        rows = places[segments] + shares[:, None] * np.diff(places, axis=0)[segments]
        rows = np.concatenate((rows, places[-1:]))
        place = self._first_near(rows, np.abs(np.diff(rows, axis=0)), required)
        return None if place is None else self._near(rows[place], 0.0)

    def path(self, path: Path) -> Violation | None:
        """Return what is wrong with a path, of its positions; None for nothing.

        Args:
            path: The path.
        """
        control = _control_values(path)
        lower, upper = control.min(axis=1), control.max(axis=1)
        outside = (lower < self._limits.lower - LIMIT_TOLERANCE) | (
            upper > self._limits.upper + LIMIT_TOLERANCE
        )
        for segment in np.flatnonzero(outside.any(axis=1)).tolist():
            time = float(path.starts[segment])
            return self._beyond(lower[segment], upper[segment], time)
        required, spacing = self._required(path.at(0.0).position, path.end.position)
        most = DEGREE * np.abs(np.diff(control, axis=1)).max(axis=1)  # bounds the way of a segment
        bend = (DEGREE - 1) * DEGREE * np.abs(np.diff(control, 2, axis=1)).max(axis=1)
        counts = np.maximum(np.ceil(self._motions(most) / spacing).astype(int), 1)
        segments, shares = _laid_out(counts)
        times = path.starts[segments] + path.durations[segments] * shares
        times = np.append(times, path.duration)
        rows = path.positions(times)
        # what turns back between two rows, by the second derivative
        turned = 0.5 * (bend / counts[:, None] ** 2)[segments]
        place = self._first_near(rows, np.abs(np.diff(rows, axis=0)) + turned, required)
        return None if place is None else self._near(rows[place], float(times[place]))

    def _motions(self, ways: Array) -> Array:
        """Return how far a shape moves against another at most in [m] (m) on ways (m, n)."""
        motions: Array = (ways @ self._clearances.distance_rate_bounds.T).max(axis=1, initial=0.0)
        return motions

    def _required(self, start: Array, goal: Array) -> tuple[Array, float]:
        """Return the distance that each pair must keep in [m] (k), and that of the places."""
        ends = np.minimum(*(self._clearances.least(each, MARGIN).copy() for each in (start, goal)))
        required = np.clip(ends, 0.0, MARGIN)
        margin = max(float(required.min(initial=MARGIN)), MIN_MARGIN)
        return required - LIMIT_TOLERANCE, 2.0 * margin

    def _first_near(self, rows: Array, ways: Array, required: Array) -> int | None:
        """Return a row at which a pair is nearer than it may be; None for none.

        Args:
            rows: Joint positions in [rad] (m, n).
            ways: How far each joint turns at most from a row to the next in [rad] (m - 1, n).
            required: Distance of each pair in [m] (k).
        """
        scene, last = self.scene, len(rows) - 1
        native, geometry = scene.kinematics.native, scene.geometry
        moved = np.zeros((len(required), len(rows)))
        np.cumsum(scene.distance_rate_bounds @ ways.T, axis=1, out=moved[:, 1:])
        due = [(0, pair) for pair in range(len(required))]  # a heap: where to measure which pair
        here = -1
        while due:
            row, pair = heappop(due)
            if row != here:
                here = row
                expanded = scene.kinematics.expanded(rows[row])
                pin.forwardKinematics(native, self._data, expanded)
                pin.updateGeometryPlacements(native, self._data, geometry, self._results)
            distance = pin.computeDistance(geometry, self._results, pair).min_distance
            if distance < required[pair]:
                return row
            along = moved[pair]
            reach = int(along.searchsorted(along[row] + distance, 'right')) - 1
            if reach < last:
                heappush(due, (max(reach, row + 1), pair))
        return None

    def _beyond(self, lower: Array, upper: Array, time: float) -> Violation | None:
        limits = self._limits
        if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
            return Violation('joint positions must be finite numbers', lower, time=time)
        beyond = np.maximum(limits.lower - lower, upper - limits.upper)
        joint = int(beyond.argmax())
        if beyond[joint] <= LIMIT_TOLERANCE:
            return None
        place = lower if lower[joint] < limits.lower[joint] else upper
        reason = (
            f'{limits.names[joint]} at {place[joint]:.4f} is beyond its range'
            f' {limits.lower[joint]:.4f}..{limits.upper[joint]:.4f}'
        )
        return Violation(reason, place, time=time)

    def _touching(self, positions: Array, time: float) -> Violation | None:
        contacts = self._clearances.contacts(positions)
        if not contacts:
            return None
        deepest = contacts[0]
        at = ', '.join(f'{each:.3f}' for each in deepest.position.tolist())
        reason = (
            f'{deepest.bodies[0]} touches {deepest.bodies[1]}, {1e3 * deepest.depth:.1f} mm deep'
            f' at ({at}) m in {self.scene.kinematics.root}'
        )
        return Violation(reason, positions, deepest, time)

    def _near(self, positions: Array, time: float) -> Violation:
        touching = self._touching(positions, time)
        if touching is not None:
            return touching
        distances = self._clearances.least(positions, MARGIN)
        pair = int(distances.argmin())
        first, second = self._clearances.pairs[pair]
        reason = f'{first} passes {second} at {1e3 * distances[pair]:.2f} mm'
        return Violation(reason, positions, None, time)


def _laid_out(counts: Places) -> tuple[Places, Array]:
    """Return segments that are cut into counts of parts: their numbers, and where each begins."""
    segments = np.repeat(np.arange(len(counts)), counts)
    numbers = np.arange(len(segments)) - np.repeat(np.cumsum(counts) - counts, counts)
    return segments, numbers / counts[segments]


def _control_values(path: Path) -> Array:
    """Return the control values of the segments' positions (k, 6, n), in whose hull they lie."""
    powers = np.arange(DEGREE + 1.0)
    scaled = path.coefficients * (path.durations[:, None] ** powers)[:, :, None]
    control: Array = np.einsum('cp,kpn->kcn', _BERNSTEIN, scaled)
    return control


# control values of a polynomial on 0..1 by its coefficients: Farin, "Curves and Surfaces for CAGD"
_BERNSTEIN = np.array(
    [
        [math.comb(row, power) / math.comb(DEGREE, power) for power in range(DEGREE + 1)]
        for row in range(DEGREE + 1)
    ]
)
