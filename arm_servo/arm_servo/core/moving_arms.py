# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Arms of one robot that move at the same time: each knows how the others would come to rest."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from heapq import heappop, heappush
from itertools import count, pairwise
import threading

import numpy as np

from arm_model import (
    Array,
    Clearances,
    LeastClearance,
    Mask,
    PlanningScene,
    RobotModel,
    RobotState,
)
from arm_trajectory import Plan

MIN_LOOKS, MAX_LOOKS = 4, 12
"""Into how many parts two stops are cut at first, at least and at most."""

MAX_STRIDE = 0.15  # way of all joints in such a part in [rad]

MAX_HALVINGS = 24
"""How many parts are halved at most, those first in which the arms may be nearest."""

PRECISION = 5e-5  # how well the least distance is to be known in [m]

HORIZON = 0.05
"""Distance beyond that of interest up to which it is measured, and not only bounded, in [m]."""


@dataclass(frozen=True, slots=True, eq=False)
class _Stop:
    """How an arm would come to rest from a moment on."""

    end: Array  # where it would stand in [rad]
    plan: Plan | None = None  # the way there; None where it stands
    begin: float = 0.0  # steady time of its begin in [s]

    @classmethod
    def of(cls, plan: Plan, begin: float) -> _Stop:
        return cls(plan.at(plan.duration).position, plan, begin)

    @property
    def until(self) -> float:
        """Steady time at which the arm stands in [s]."""
        return self.begin if self.plan is None else self.begin + self.plan.duration

    @property
    def extremes(self) -> tuple[Array, Array]:
        """Least and greatest position of each joint in [rad]."""
        return (self.end, self.end) if self.plan is None else self.plan.extremes

    def places(self, times: Array) -> Array:
        """Return positions at steady times (m, n) in [rad]."""
        if self.plan is None or times[0] >= self.until:
            return np.broadcast_to(self.end, (len(times), len(self.end)))
        since = np.clip(times - self.begin, 0.0, self.plan.duration)
        return np.array([self.plan.at(time).position for time in since.tolist()])


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """One moment of the stops."""

    time: float  # steady time in [s]
    places: Array  # positions of all joints in [rad]
    distances: Array  # distance of each pair in [m], or a lower bound of one that is far


def _nearest(
    looks: Sequence[_Look], rates: Array, look: Callable[[Array], Sequence[_Look]]
) -> _Look:
    """Return the look at which the arms are nearest, of more looks where that is not sure.

    Between two looks a pair comes no nearer than half of what its distances are more than its way.
    """
    best = min(looks, key=lambda each: float(each.distances.min()))
    number = count()
    parts: list[tuple[float, int, _Look, _Look]] = []

    def add(first: _Look, last: _Look) -> None:
        ways = rates @ np.abs(last.places - first.places)
        bound = float((0.5 * (first.distances + last.distances - ways)).min())
        heappush(parts, (bound, next(number), first, last))

    for first, last in pairwise(looks):
        add(first, last)
    for _ in range(MAX_HALVINGS):
        bound, _number, first, last = heappop(parts)
        if bound >= float(best.distances.min()) - PRECISION:
            break
        (middle,) = look(np.array([0.5 * (first.time + last.time)]))
        best = min(best, middle, key=lambda each: float(each.distances.min()))
        add(first, middle)
        add(middle, last)
    return best


class MovingArms:
    """Where arms of one robot would come to rest, and how near they come to each other then.

    Each arm lets the others know its shortest stop in every step, and takes a step only when its
    own stop behind it stays clear of theirs, at the same times. So there is always a way for all
    of them to come to rest without contact: the stops of the steps before.

    Attributes:
        lock: Held while an arm looks at the others and lets them know its stop: loops of several
            threads take turns.
    """

    def __init__(self, models: Sequence[RobotModel]) -> None:
        self.lock = threading.Lock()
        self.version = 0
        self._groups = [model.joints for model in models]
        self._given = models[0].scene.with_allowed(models[0].allowed)
        scene = self._given.between(self._groups)
        joints = scene.kinematics.joints
        self._columns = [np.array([joints.index(name) for name in g]) for g in self._groups]
        self._clearances = Clearances(scene)
        self._stops: list[_Stop | None] = [None for _ in models]

    def neighbours(self, joints: Sequence[str]) -> Neighbours:
        """Return the other arms as one of them sees them."""
        return Neighbours(self, self._groups.index(tuple(joints)))

    def use_scene(self, scene: PlanningScene) -> None:
        """Use attached bodies, allowed collisions and joints beside the arms of a scene.

        It is measured here, in the thread of the caller.

        Args:
            scene: A scene of one of the arms, in which the others are checked.
        """
        given, present = self._given, self._clearances.scene
        if scene is given:
            return
        self._given = scene
        others = present.kinematics.with_others(scene.kinematics.others)
        if (
            others is present.kinematics
            and scene.allowed == given.allowed
            and scene.link_shapes == given.link_shapes
            and scene.attached_bodies == given.attached_bodies
        ):
            return
        clearances = Clearances(scene.between(self._groups))
        with self.lock:
            places = self._ends()
        clearances.least(places, 0.0)
        with self.lock:
            self._clearances = clearances
            self.version += 1

    def put(self, number: int, stop: _Stop | None) -> None:
        """Publish to the others how an arm would come to rest; None while that is unknown."""
        self._stops[number] = stop

    def least(self, number: int, plan: Plan, begin: float, within: float) -> LeastClearance:
        """Return the least distance of an arm that stops to the others, which stop too."""
        stops = [*self._stops]
        stops[number] = _Stop.of(plan, begin)
        known = [
            (columns, stop)
            for columns, stop in zip(self._columns, stops, strict=True)
            if stop is not None
        ]
        least = LeastClearance(within)
        if len(known) == 1:
            return least
        clearances = self._clearances
        lower = np.zeros(clearances.distance_rate_bounds.shape[1])
        upper = lower.copy()
        for columns, stop in known:
            lower[columns], upper[columns] = stop.extremes
        if clearances.apart(lower, upper, within):
            return least
        # an arm that has stepped already is in the next cycle: all are from there on
        begin = max(begin, *(stop.begin for _, stop in known))
        duration = max(0.0, *(stop.until - begin for _, stop in known))
        looks = min(max(MIN_LOOKS, round(float((upper - lower).sum()) / MAX_STRIDE)), MAX_LOOKS)

        def look(times: Array) -> list[_Look]:
            places = np.zeros((len(times), len(lower)))
            for columns, stop in known:
                places[:, columns] = stop.places(times)
            return [
                _Look(time, row, np.where(counts, clearances.least(row, interest), np.inf))
                for time, row in zip(times.tolist(), places, strict=True)
            ]

        counts, interest = self._counts(stops), within + HORIZON
        found = look(begin + np.linspace(0.0, duration, looks + 1))
        nearest = _nearest(found, clearances.distance_rate_bounds, look)
        pair = int(nearest.distances.argmin())
        if nearest.distances[pair] < within:
            least = LeastClearance(float(nearest.distances[pair]), clearances.pairs[pair])
        return least

    def _counts(self, stops: Sequence[_Stop | None]) -> Mask:
        """Return the pairs that no arm moves whose place is not known."""
        moved = self._clearances.distance_rate_bounds > 0.0
        counts: Mask = np.ones(len(moved), dtype=bool)
        for columns, stop in zip(self._columns, stops, strict=True):
            if stop is None:
                counts &= ~moved[:, columns].any(axis=1)
        return counts

    def _ends(self) -> Array:
        """Return where all joints would stand in [rad]."""
        places = np.zeros(self._clearances.distance_rate_bounds.shape[1])
        for columns, stop in zip(self._columns, self._stops, strict=True):
            if stop is not None:
                places[columns] = stop.end
        return places


class Neighbours:
    """The other arms as one of them sees them; for its loop, while it holds :attr:`lock`."""

    def __init__(self, arms: MovingArms, number: int) -> None:
        self._arms, self._number = arms, number
        self.lock = arms.lock

    @property
    def version(self) -> int:
        """Number of the scene that counts."""
        return self._arms.version

    def least(self, stop: Plan, begin: float, within: float) -> LeastClearance:
        """Return the least distance to the others on a stop, while they stop too."""
        return self._arms.least(self._number, stop, begin, within)

    def stops(self, plan: Plan, begin: float) -> None:
        """Publish to the others the stop behind a step."""
        self._arms.put(self._number, _Stop.of(plan, begin))

    def stands(self, state: RobotState | None) -> None:
        """Publish to the others where the arm is while something else may move it."""
        self._arms.put(self._number, None if state is None else _Stop(state.position))
