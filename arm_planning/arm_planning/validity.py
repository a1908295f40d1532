# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Checks states and paths of an arm: position limits and collisions.

The check bisects a path. In the middle of each part it measures the pairs not yet proven clear
there. Distance rate bounds turn a distance into an interval around the middle that is free of
contact; what is left on either side is measured again. Each pair must keep :data:`MARGIN`
wherever it is measured. So motions between measurements are free of contact as well, and distant
pairs need few measurements. The compiled core (:func:`arm_model.compiled_scene`) does this if it
is available; the Python code is its reference.

A pair nearer than the margin at start or goal may stay as near along the path, and is
measured more densely; a contact of less than :data:`MIN_MARGIN` can then remain.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
import math

import numpy as np

from arm_model import (
    Array,
    checked,
    Clearances,
    compiled_scene,
    Contact,
    JointLimits,
    PlanningScene,
)
from arm_trajectory import farthest_beyond, Path

from .exceptions import coded, PlanningCode, PlanningError

MARGIN = 1e-3  # distance that every pair keeps in [m] where a path is measured
MIN_MARGIN = 1e-4  # the same where start or goal are nearer to contact in [m]
LIMIT_TOLERANCE = 1e-6  # how far a position may be beyond a limit, for rounding, in [rad]
DEGREE = 5  # of the polynomials of a path
CELLS = 8  # parts of a segment of a path of which each has its own bound of the motion
FIRST_PART = 1.0  # motion of a shape within the parts of a path that are looked at first in [m]


@dataclass(frozen=True, slots=True, eq=False)
class Violation:
    """Why a state or a path is not valid."""

    reason: str  # in words: the joint and its limit, or the bodies with depth and place
    positions: Array  # joint positions there in [rad]
    # the deepest contact; None for a violated limit, or bodies that are only near
    contact: Contact | None = None
    time: float = 0.0  # when on the path in [s]; 0 for a state


class ValidityCheck:
    """Checks states and paths in one scene. Not thread-safe."""

    def __init__(self, limits: JointLimits, scene: PlanningScene) -> None:
        self._limits, self.scene = limits, scene
        self.compiled = compiled_scene(scene)

    @cached_property
    def _clearances(self) -> Clearances:
        return Clearances(self.scene)

    def state(self, positions: Array) -> Violation | None:
        """Return why a state is not valid; None if it is valid."""
        return self.beyond(positions) or self._touching(positions, 0.0)

    def required(self, *ends: Array) -> Array:
        """Return the distance that each pair must keep on motions between states in [m] (k)."""
        measured = self.compiled or self._clearances
        least = [measured.least(each, MARGIN).copy() for each in ends]
        required: Array = np.clip(np.min(least, axis=0), 0.0, MARGIN) - LIMIT_TOLERANCE
        return required

    def near(self, begin: Array, end: Array, required: Array) -> Array | None:
        """Return a state of a straight motion at which a pair is too near, or None.

        ``required`` is the distance in [m] that each pair must keep (k).
        """
        way = end - begin
        if self.compiled is not None:
            share = self.compiled.edge(begin, end, required)
            return None if share is None else begin + share * way
        needed = required.tolist()
        motions = (self.scene.distance_rate_bounds @ np.abs(way)).tolist()
        every: Sequence[int] = range(len(needed))
        parts = deque([(0.5, 0.5, every)])  # their middle, half their length
        while parts:
            middle, half, pairs = parts.popleft()
            place = begin + middle * way
            left = self._doubtful(place, pairs, needed, motions, half)
            if left is None:
                return place
            if left:  # what lies nearer to the middle is proved
                proved = min(distance / motions[pair] for pair, distance in left.items())
                rest = 0.5 * (half - max(proved, 0.0))
                parts.append((middle - half + rest, rest, list(left)))
                parts.append((middle + half - rest, rest, list(left)))
        return None

    def waypoints(self, places: Array) -> Violation | None:
        """Return where straight motions between waypoints (m, n) are not valid, or None."""
        lower, upper = places.min(axis=0), places.max(axis=0)
        if (beyond := self._beyond(lower, upper)) is not None:
            return beyond
        required = self.required(places[0], places[-1])
        for begin, end in pairwise(places):
            place = self.near(begin, end, required)
            if place is not None:
                return self._near(place, 0.0)
        return None

    def path(self, path: Path) -> Violation | None:
        """Return where a path violates position limits or clearances; None if it is valid."""
        beyond = farthest_beyond(path, self._limits.lower, self._limits.upper)
        if beyond is not None:
            positions = path.at(beyond.time).position
            words = self._limits.beyond_words(beyond.joint, beyond.position)
            return Violation(words, positions, time=beyond.time)
        return self.contact(path)

    def contact(self, path: Path) -> Violation | None:
        """Return where a pair comes too near on a path; None if no pair does."""
        found = self._near_time(path, path.control_values)
        return None if found is None else self._near(path.at(found).position, found)

    def start(self, positions: Sequence[float] | Array) -> Array:
        """Return a valid start state, or raise a PlanningError with reason and remedy."""
        with coded(PlanningCode.INVALID_ROBOT_STATE):
            start = checked(positions, len(self._limits), 'start')
        violation = self.state(start)
        if violation is None:
            return start
        if violation.contact is None:
            raise PlanningError(PlanningCode.START_STATE_INVALID, f'start: {violation.reason}')
        raise PlanningError(
            PlanningCode.START_STATE_IN_COLLISION,
            f'start: {violation.reason}; jog the arm clear of it, or change the scene: remove,'
            ' attach or allow it',
        )

    def beyond(self, positions: Array) -> Violation | None:
        """Return the violation if a joint is beyond its limits, or None."""
        return self._beyond(positions, positions)

    def _near_time(self, path: Path, control: Array) -> float | None:
        """Return a time at which a pair is too near; None if no pair ever is."""
        times, turned = _cells(path, control)
        rates, cells = self.scene.distance_rate_bounds, np.arange(float(len(times)))
        required = self.required(path.at(0.0).position, path.end.position)
        along = turned @ rates.max(axis=0, initial=0.0)  # halves of a part move alike
        if self.compiled is not None:
            polynomials, bounds = (path.starts, path.coefficients), (times, along, turned)
            return self.compiled.path(polynomials, bounds, FIRST_PART, required)
        needed = required.tolist()
        ends = np.linspace(0.0, along[-1], max(math.ceil(along[-1] / FIRST_PART), 1) + 1)
        parts = np.stack((ends[:-1], ends[1:]), axis=1)
        pairs: list[Sequence[int]] = [range(len(needed))] * len(parts)
        while len(parts):
            looks = np.insert(parts, 1, parts.mean(axis=1), axis=1)
            places = np.interp(looks, along, cells)
            when = np.interp(places[:, 1], cells, times)
            turns = np.diff(_interpolated(turned, places), axis=1).max(axis=1)
            motions = (turns @ rates.T).tolist()
            rows = zip(when.tolist(), path.positions(when), pairs, motions, looks, strict=True)
            rest: list[tuple[float, float]] = []
            doubtful: list[Sequence[int]] = []
            for when_there, row, here, moved, (first, middle, last) in rows:
                left = self._doubtful(row, here, needed, moved, 1.0)
                if left is None:
                    return float(when_there)
                # no pair comes nearer by more than what lies between
                proved = max(min(left.values(), default=math.inf), 0.0)
                if proved < middle - first:
                    rest += [(first, middle - proved), (middle + proved, last)]
                    doubtful += [list(left), list(left)]
            parts, pairs = np.array(rest), doubtful
        return None

    def _doubtful(
        self,
        place: Array,
        pairs: Sequence[int],
        required: Sequence[float],
        motions: Sequence[float],
        share: float,
    ) -> dict[int, float] | None:
        """Return the pairs that may come too near within a part, and their distances in [m].

        Return None if a pair is too near already.
        """
        left, found = {}, self._clearances.measure(place, pairs)
        for pair in pairs:
            distance = found[pair].min_distance
            if distance < required[pair]:
                return None
            moved = share * motions[pair]
            if moved > distance and moved > MIN_MARGIN:
                left[pair] = distance
        return left

    def _beyond(self, lower: Array, upper: Array) -> Violation | None:
        """Return the violation if a joint is beyond its limits between two bounds, or None."""
        if not (np.isfinite(lower).all() and np.isfinite(upper).all()):
            return Violation('joint positions must be finite numbers', lower)
        found = ((self._limits.beyond(each, LIMIT_TOLERANCE), each) for each in (lower, upper))
        return next((Violation(words, each) for words, each in found if words), None)

    def _touching(self, positions: Array, time: float) -> Violation | None:
        if self.compiled is not None and self.compiled.clear(positions, 0.0):
            return None
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
        first, second = self.scene.pairs[pair]
        reason = f'{first} passes {second} at {1e3 * distances[pair]:.2f} mm'
        return Violation(reason, positions, None, time)


def _cells(path: Path, control: Array) -> tuple[Array, Array]:
    """Return the times (c) that cut a path into cells, and an upper bound of the joint travel.

    The bound grows linearly within a cell. It follows from the velocity at both ends of the
    cell and the change of velocity between them.
    """
    count = len(path.durations)
    segments = np.repeat(np.arange(count), CELLS)
    lasts = np.repeat(path.durations / CELLS, CELLS)
    offsets = np.tile(np.arange(CELLS) / CELLS, count) * path.durations[segments]
    ends = [np.abs(path.derived(1, segments, each)) for each in (offsets, offsets + lasts)]
    bend = (DEGREE - 1) * DEGREE * np.abs(np.diff(control, 2, axis=1)).max(axis=1)
    bend /= path.durations[:, None] ** 2
    most = np.maximum(*ends) + 0.5 * lasts[:, None] * bend[segments]
    turned = np.concatenate((np.zeros((1, most.shape[1])), np.cumsum(most * lasts[:, None], 0)))
    return np.append(path.starts[segments] + offsets, path.duration), turned


def _interpolated(rows: Array, places: Array) -> Array:
    """Return rows interpolated linearly at fractional indices (m, n)."""
    before = np.minimum(places.astype(int), len(rows) - 2)
    share = (places - before)[..., None]
    found: Array = rows[before] + share * (rows[before + 1] - rows[before])
    return found
