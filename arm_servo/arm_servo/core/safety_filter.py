# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The last word on every set-point: the arm can always still stop within its limits.

Arms of one robot that move at the same time know of each other how they would come to rest, and
keep apart also while all of them stop: :class:`MovingArms`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
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
from arm_trajectory import hard_brake, OnlineTrajectoryGenerator, Plan

from ..controllers.controller import Cause, Limiter

LeastOnStop = Callable[[Plan, float, float], LeastClearance]
"""Measures a stop, of its begin in [s] and the distance of interest in [m]."""

CONTACT_TOLERANCE = 1e-4
"""Change of a distance that is let pass, in all, in [m]: sliding along is no approach."""

MIN_SAMPLES, MAX_SAMPLES = 6, 40
"""How many places of a stop distances are looked at, at least and at most."""

MAX_STRIDE = 0.1  # way of all joints between two looks in [rad]

NEAR_ARM = 0.1
"""Distance to other arms in [m] below which an arm may be stopped off its path, so that its stops
must be clear of everything."""

ROUNDING_TOLERANCE = 1e-7  # rounding of ruckig's positions that is let pass in [rad]


class ClearanceFloor:
    """How near links may come on a stop: as near as asked, or as they cannot help.

    Links that are nearer than they should be may stay as they are, not come nearer.
    """

    def __init__(self, least: LeastOnStop, brake: Callable[[RobotState], Plan | None]) -> None:
        self._least, self._brake = least, brake
        self._clearance = 0.0  # for which the floor was found
        self._floor: float | None = None

    def forget(self) -> None:
        """Measure anew how near links may be."""
        self._floor = None

    def too_near(
        self, stop: Plan, begin: float, state: RobotState, now: float, clearance: float | None
    ) -> LeastClearance | None:
        """Return which links a stop would bring too near, and how near; None for none."""
        if clearance is None:
            self._floor = None
            return None
        if clearance != self._clearance:
            self._clearance, self._floor = clearance, None
        if self._floor is None:
            present = self._brake(state)
            self._floor = clearance if present is None else self._distance(present, now)
            self._floor = min(self._floor, clearance)
        near = self._least(stop, begin, clearance)
        if near.distance < self._floor - CONTACT_TOLERANCE:
            # what stopping now brings about cannot be had better
            present = self._brake(state)
            least = self._floor - CONTACT_TOLERANCE
            least = least if present is None else min(self._floor, self._distance(present, now))
            self._floor = min(self._floor, least + CONTACT_TOLERANCE)
        if near.distance < self._floor - CONTACT_TOLERANCE - ROUNDING_TOLERANCE:
            return near
        self._floor = max(self._floor, min(near.distance, clearance))
        return None

    def allows(self, plan: Plan, begin: float) -> bool:
        """Whether links stay apart on another stop than the one that was looked at last."""
        if self._floor is None:
            return True
        return self._distance(plan, begin) >= self._floor - CONTACT_TOLERANCE

    def _distance(self, plan: Plan, begin: float) -> float:
        return self._least(plan, begin, self._clearance).distance


class SafetyFilter:
    """Lets a step pass only when the shortest stop behind it stays within the limits.

    A joint that could not stop any more brakes instead; where links would come too near, all do.
    As the step before has passed, there is always a stop to fall back on. An arm that begins
    beyond a limit, or in contact, may go back and may not go further.
    """

    def __init__(self, model: RobotModel, generator: OnlineTrajectoryGenerator) -> None:
        self._model = model
        self._limits = model.limits
        self._generator = generator
        self._lower: Array = model.limits.lower
        self._upper: Array = model.limits.upper
        self._anywhere: Array = np.full(len(model), np.inf)
        self._floor = ClearanceFloor(self._least, generator.brake)
        self._fastest: Array = model.limits.velocity * (1.0 + 1e-6)
        self._neighbours: Neighbours | None = None
        self._lock: AbstractContextManager[object] = nullcontext()
        self._apart = self._floor
        self._version = 0
        self.is_near_neighbour = False

    @property
    def is_alone(self) -> bool:
        """Whether there are no other arms to heed, also at rest."""
        return self._neighbours is None

    def keep_apart(self, neighbours: Neighbours) -> None:
        """Heed from now on how other arms move."""
        self._neighbours, self._lock = neighbours, neighbours.lock
        self._apart = ClearanceFloor(neighbours.least, self._generator.brake)

    def stands(self, state: RobotState | None) -> None:
        """Publish to other arms where the arm is while something else has its drives."""
        if self._neighbours is not None:
            with self._lock:
                self._neighbours.stands(state)

    def reset(self, state: RobotState) -> None:
        """Begin at a state."""
        stop = self._generator.brake(state)
        self._lower, self._upper = -self._anywhere, self._anywhere
        self._floor.forget()
        self._apart.forget()
        self.stands(state)
        if stop is not None:
            self._remember(stop)

    def forget(self) -> None:
        """Measure anew how near links may be: what may collide has changed."""
        self._floor.forget()

    def step(
        self,
        state: RobotState,
        wanted: RobotState,
        period: float,
        clearance: float | None,
        *,
        now: float = 0.0,
        apart: float | None = None,
    ) -> tuple[RobotState, Limiter | None]:
        """Return the step if it is safe, else a braking one.

        Args:
            clearance: Least distance between links on a stop in [m]; None where what moves the
                arm keeps to a path that was checked. Near other arms it counts as 0 then.
            apart: Least distance to other arms that move, while all stop, in [m]; None is any.

        Returns:
            The state to command, and what held the wanted one up.
        """
        with self._lock:  # no other arm steps meanwhile
            if self._neighbours is not None and self._neighbours.version != self._version:
                self._version = self._neighbours.version
                self._apart.forget()
            beyond, stop = self._beyond(wanted)
            limiter, end = None, now + period
            self.is_near_neighbour = False
            if beyond.any():  # these joints brake, each for itself; the others go on
                limiter = self._limit(wanted, int(np.argmax(beyond)))
                slower = self._brake(state, period, now)
                wanted = RobotState(
                    np.where(beyond, slower.position, wanted.position),
                    np.where(beyond, slower.velocity, wanted.velocity),
                    np.where(beyond, slower.acceleration, wanted.acceleration),
                )
                beyond, stop = self._beyond(wanted)
            if stop is not None and not beyond.any():
                if clearance is None and self._may_meet(stop, end, apart):
                    clearance = 0.0  # it may have to leave its path for the other arm
                near = self._floor.too_near(stop, end, state, now, clearance)
                if near is None and self._neighbours is not None:
                    near = self._apart.too_near(stop, end, state, now, apart)
                    self.is_near_neighbour = near is not None
                if near is None:
                    self._remember(stop)
                    self._announce(stop, end)
                    return wanted, limiter
                limiter = Limiter(Cause.COLLISION, ' - '.join(near.links), near.distance, 0.0)
                eased = self._eased(state, period, now)
                if eased is not None:
                    return eased, limiter
            return self._brake(state, period, now), limiter

    def _may_meet(self, stop: Plan, begin: float, apart: float | None) -> bool:
        """Whether another arm may soon be in the way of a stop."""
        if self._neighbours is None or apart is None:
            return False
        within = apart + NEAR_ARM
        return self._neighbours.least(stop, begin, within).distance < within

    def _beyond(self, wanted: RobotState) -> tuple[Mask, Plan | None]:
        """Return which joints can no longer stop within their limits, and the stop of all."""
        coasting = wanted.acceleration * np.abs(wanted.acceleration) / (2.0 * self._limits.jerk)
        peak = np.maximum(np.abs(wanted.velocity + coasting), np.abs(wanted.velocity))
        beyond: Mask = peak > self._fastest
        stop = self._generator.brake(wanted)
        if stop is None:
            return np.ones_like(beyond), None
        lower, upper = stop.extremes
        too_low = lower < self._lower - ROUNDING_TOLERANCE
        too_high = upper > self._upper + ROUNDING_TOLERANCE
        return beyond | too_low | too_high, stop

    def _limit(self, wanted: RobotState, joint: int) -> Limiter:
        """Name the limit that a joint would break."""
        name, speed = self._limits.names[joint], float(abs(wanted.velocity[joint]))
        if speed > self._fastest[joint]:
            return Limiter(Cause.JOINT_VELOCITY, name, speed, 0.0)
        ways = (
            wanted.position[joint] - self._limits.lower[joint],
            self._limits.upper[joint] - wanted.position[joint],
        )
        return Limiter(Cause.JOINT_POSITION, name, float(min(ways)), 0.0)

    def _remember(self, stop: Plan) -> None:
        """Allow as much beyond the limits as the present stop needs, and no more."""
        if self._lower is self._limits.lower and self._upper is self._limits.upper:
            return
        lower, upper = stop.extremes
        self._lower = np.minimum(self._limits.lower, np.maximum(self._lower, lower))
        self._upper = np.maximum(self._limits.upper, np.minimum(self._upper, upper))
        if (self._lower == self._limits.lower).all() and (self._upper == self._limits.upper).all():
            self._lower, self._upper = self._limits.lower, self._limits.upper  # for good

    def _announce(self, stop: Plan, begin: float) -> None:
        """Publish to other arms how this one would come to rest now."""
        if self._neighbours is not None:
            self._neighbours.stops(stop, begin)

    def _least(self, stop: Plan, _begin: float, clearance: float) -> LeastClearance:
        """Return the least distance between links on a stop, if it is small."""
        least, clearances = LeastClearance(clearance), self._model.clearances
        if clearances.apart(*stop.extremes, clearance):
            return least
        way = np.ptp(np.stack(stop.extremes), axis=0).sum()
        looks = min(max(MIN_SAMPLES, round(way / MAX_STRIDE)), MAX_SAMPLES)
        times = np.linspace(0.0, stop.duration, looks + 1)[1:].tolist()
        places = np.array([stop.at(time).position for time in times])
        for positions in places[clearances.provably_clear(places, clearance) :]:
            distances = clearances.least(positions, clearance)
            pair = int(distances.argmin())
            if distances[pair] < least.distance:
                least = LeastClearance(float(distances[pair]), clearances.pairs[pair])
        return least

    def _eased(self, state: RobotState, period: float, now: float) -> RobotState | None:
        """Brake with the joints in step, which keeps the direction, where that is clear too."""
        plan = self._generator.to_velocity(state, np.zeros(len(self._limits)))
        if plan is None or period >= plan.duration:
            return None
        after = plan.at(period)
        beyond, stop = self._beyond(after)
        if stop is None or beyond.any() or not self._floor.allows(plan, now):
            return None
        if self._neighbours is not None:
            if not (self._apart.allows(plan, now) and self._apart.allows(stop, now + period)):
                return None
            self._announce(stop, now + period)
        self._remember(stop)
        return after

    def _brake(self, state: RobotState, period: float, now: float) -> RobotState:
        stop = self._generator.brake(state)
        if stop is None:
            return hard_brake(state, self._limits, period)
        self._announce(stop, now)
        if period >= stop.duration:
            return RobotState.at_rest(stop.at(stop.duration).position)
        return stop.at(period)


MIN_LOOKS, MAX_LOOKS = 4, 12
"""Into how many parts two stops are cut at first, at least and at most."""

MAX_PART_STRIDE = 0.15  # way of all joints in such a part in [rad]

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
        # how each would come to rest; None while that is not known
        self.stops: list[_Stop | None] = [None for _ in models]

    def neighbours(self, joints: Sequence[str]) -> Neighbours:
        """Return the other arms as one of them sees them."""
        return Neighbours(self, self._groups.index(tuple(joints)))

    def use_scene(self, scene: PlanningScene) -> None:
        """Use attached bodies, allowed collisions and joints beside the arms of a scene.

        It is measured here, in the thread of the caller.
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

    def least(self, number: int, plan: Plan, begin: float, within: float) -> LeastClearance:
        """Return the least distance of an arm that stops to the others, which stop too."""
        stops = [*self.stops]
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
        lower = np.zeros(clearances.scene.distance_rate_bounds.shape[1])
        upper = lower.copy()
        for columns, stop in known:
            lower[columns], upper[columns] = stop.extremes
        if clearances.apart(lower, upper, within):
            return least
        # an arm that has stepped already is in the next cycle: all are from there on
        begin = max(begin, *(stop.begin for _, stop in known))
        duration = max(0.0, *(stop.until - begin for _, stop in known))
        looks = min(
            max(MIN_LOOKS, round(float((upper - lower).sum()) / MAX_PART_STRIDE)), MAX_LOOKS
        )

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
        nearest = _nearest(found, clearances.scene.distance_rate_bounds, look)
        pair = int(nearest.distances.argmin())
        if nearest.distances[pair] < within:
            least = LeastClearance(float(nearest.distances[pair]), clearances.pairs[pair])
        return least

    def _counts(self, stops: Sequence[_Stop | None]) -> Mask:
        """Return the pairs that no arm moves whose place is not known."""
        moved = self._clearances.scene.distance_rate_bounds > 0.0
        counts: Mask = np.ones(len(moved), dtype=bool)
        for columns, stop in zip(self._columns, stops, strict=True):
            if stop is None:
                counts &= ~moved[:, columns].any(axis=1)
        return counts

    def _ends(self) -> Array:
        """Return where all joints would stand in [rad]."""
        places = np.zeros(self._clearances.scene.distance_rate_bounds.shape[1])
        for columns, stop in zip(self._columns, self.stops, strict=True):
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
        self._arms.stops[self._number] = _Stop.of(plan, begin)

    def stands(self, state: RobotState | None) -> None:
        """Publish to the others where the arm is while something else may move it."""
        self._arms.stops[self._number] = None if state is None else _Stop(state.position)
