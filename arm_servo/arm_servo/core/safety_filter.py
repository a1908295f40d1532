# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Safety filter of every set-point: the arm can always stop within its limits.

:class:`MovingArms` shares the stopping motions of arms of one robot that move at the same time,
and keeps them apart even while all of them stop.
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
"""Measures least clearance on a stop, from its start time [s] and distance of interest [m]."""

CONTACT_TOLERANCE = 1e-4
"""Total decrease of a distance that is tolerated, in [m]: sliding along is no approach."""

MIN_SAMPLES, MAX_SAMPLES = 6, 40
"""Least and greatest number of samples of a stop at which distances are measured."""

MAX_STRIDE = 0.1  # sum of joint motions between two samples in [rad]

NEAR_ARM = 0.1
"""Distance to other arms in [m] below which an arm may have to stop off its path, so that its
stops must be checked for all collisions."""

ROUNDING_TOLERANCE = 1e-7  # tolerated rounding of ruckig's positions in [rad]


class ClearanceFloor:
    """Least allowed distance between links on a stop: the clearance, or what is unavoidable.

    Links that are already too near may keep their distance, but must not come nearer.
    """

    def __init__(self, least: LeastOnStop, brake: Callable[[RobotState], Plan | None]) -> None:
        self._least, self._brake = least, brake
        self._clearance = 0.0  # clearance for which the floor was measured
        self._floor: float | None = None

    def forget(self) -> None:
        """Discard the floor, so that it is measured again."""
        self._floor = None

    def too_near(
        self, stop: Plan, begin: float, state: RobotState, now: float, clearance: float | None
    ) -> LeastClearance | None:
        """Return the links that a stop brings too near, and their distance; None if clear."""
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
            # no stop can do better than stopping now
            present = self._brake(state)
            least = self._floor - CONTACT_TOLERANCE
            least = least if present is None else min(self._floor, self._distance(present, now))
            self._floor = min(self._floor, least + CONTACT_TOLERANCE)
        if near.distance < self._floor - CONTACT_TOLERANCE - ROUNDING_TOLERANCE:
            return near
        self._floor = max(self._floor, min(near.distance, clearance))
        return None

    def allows(self, plan: Plan, begin: float) -> bool:
        """Return whether links also stay apart on an alternative stop."""
        if self._floor is None:
            return True
        return self._distance(plan, begin) >= self._floor - CONTACT_TOLERANCE

    def _distance(self, plan: Plan, begin: float) -> float:
        return self._least(plan, begin, self._clearance).distance


class SafetyFilter:
    """Passes a step only if the shortest stop after it stays within the limits.

    A joint that could no longer stop brakes instead; if links would come too near, all joints
    brake. Because the previous step passed, a safe stop always exists. An arm that starts beyond
    a limit or in contact may move back, but not further.
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
        """Whether there are no other arms, moving or at rest."""
        return self._neighbours is None

    def keep_apart(self, neighbours: Neighbours) -> None:
        """Keep clear of other arms from now on."""
        self._neighbours, self._lock = neighbours, neighbours.lock
        self._apart = ClearanceFloor(neighbours.least, self._generator.brake)

    def stands(self, state: RobotState | None) -> None:
        """Share the arm's position with other arms while something else commands its drives."""
        if self._neighbours is not None:
            with self._lock:
                self._neighbours.stands(state)

    def reset(self, state: RobotState) -> None:
        """Restart from a state."""
        stop = self._generator.brake(state)
        self._lower, self._upper = -self._anywhere, self._anywhere
        self._floor.forget()
        self._apart.forget()
        self.stands(state)
        if stop is not None:
            self._remember(stop)

    def forget(self) -> None:
        """Measure the allowed distances again, because the scene has changed."""
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
            clearance: Least distance in [m] between links on a stop; None on a path that was
                checked, treated as 0 near other arms.
            apart: Least distance in [m] to other moving arms while all stop; None: no limit.

        Returns:
            The state to command, and the limiter if it is not the wanted state.
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
        """Return whether another arm is near a stop, or may soon be."""
        if self._neighbours is None or apart is None:
            return False
        within = apart + NEAR_ARM
        return self._neighbours.least(stop, begin, within).distance < within

    def _beyond(self, wanted: RobotState) -> tuple[Mask, Plan | None]:
        """Return a mask of joints that can no longer stop within limits, and the stop of all."""
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
        """Return the limiter for the limit that a joint would exceed."""
        name, speed = self._limits.names[joint], float(abs(wanted.velocity[joint]))
        if speed > self._fastest[joint]:
            return Limiter(Cause.JOINT_VELOCITY, name, speed, 0.0)
        ways = (
            wanted.position[joint] - self._limits.lower[joint],
            self._limits.upper[joint] - wanted.position[joint],
        )
        return Limiter(Cause.JOINT_POSITION, name, float(min(ways)), 0.0)

    def _remember(self, stop: Plan) -> None:
        """Reduce the tolerated overshoot of limits to what the present stop needs."""
        if self._lower is self._limits.lower and self._upper is self._limits.upper:
            return
        lower, upper = stop.extremes
        self._lower = np.minimum(self._limits.lower, np.maximum(self._lower, lower))
        self._upper = np.maximum(self._limits.upper, np.minimum(self._upper, upper))
        if (self._lower == self._limits.lower).all() and (self._upper == self._limits.upper).all():
            self._lower, self._upper = self._limits.lower, self._limits.upper  # for good

    def _announce(self, stop: Plan, begin: float) -> None:
        """Share with other arms how this one would stop now."""
        if self._neighbours is not None:
            self._neighbours.stops(stop, begin)

    def _least(self, stop: Plan, _begin: float, clearance: float) -> LeastClearance:
        """Return the least distance between links on a stop, at most ``clearance``."""
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
        """Brake with synchronised joints, which keeps the direction; None if that is not safe."""
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
"""Least and greatest number of parts into which two stops are first divided."""

MAX_PART_STRIDE = 0.15  # sum of joint motions in such a part in [rad]

MAX_HALVINGS = 24
"""Greatest number of halvings; the part in which the arms may be nearest comes first."""

PRECISION = 5e-5  # required accuracy of the least distance in [m]

HORIZON = 0.05
"""Margin in [m] beyond the distance of interest within which distances are measured exactly."""


@dataclass(frozen=True, slots=True, eq=False)
class _Stop:
    """Stopping motion of an arm from a given time on."""

    end: Array  # rest positions in [rad]
    plan: Plan | None = None  # motion to rest; None for an arm at rest
    begin: float = 0.0  # steady start time in [s]

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
        """Return positions (m, n) in [rad] at steady times (m) in [s]."""
        if self.plan is None or times[0] >= self.until:
            return np.broadcast_to(self.end, (len(times), len(self.end)))
        since = np.clip(times - self.begin, 0.0, self.plan.duration)
        return np.array([self.plan.at(time).position for time in since.tolist()])


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """Sample of the stops at one time."""

    time: float  # steady time in [s]
    places: Array  # positions of all joints in [rad]
    distances: Array  # distance of each pair in [m], or a lower bound of one that is far


def _nearest(
    looks: Sequence[_Look], rates: Array, look: Callable[[Array], Sequence[_Look]]
) -> _Look:
    """Return the sample at which the arms are nearest, sampling more where needed.

    Between two samples a pair is no nearer than half of (sum of its distances - its motion).
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
    """Stopping motions of the arms of one robot, and the distances between them.

    In every step each arm shares its shortest stop, and executes the step only if its own stop
    after it stays clear of the others' stops at the same times. So all arms can always come to
    rest without contact: by the stops of the previous steps.

    Attributes:
        lock: Held while an arm reads the other stops and shares its own: loops of several
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
        """Return the view of the other arms for the arm with these joints."""
        return Neighbours(self, self._groups.index(tuple(joints)))

    def use_scene(self, scene: PlanningScene) -> None:
        """Apply attached bodies, allowed collisions and non-arm joints of a scene.

        The measurement runs in the thread of the caller.
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
        """Return the least distance in [m] of a stopping arm to the others, which stop too."""
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
        """Return a mask of the pairs that no arm of unknown position moves."""
        moved = self._clearances.scene.distance_rate_bounds > 0.0
        counts: Mask = np.ones(len(moved), dtype=bool)
        for columns, stop in zip(self._columns, stops, strict=True):
            if stop is None:
                counts &= ~moved[:, columns].any(axis=1)
        return counts

    def _ends(self) -> Array:
        """Return the positions of all joints in [rad] at the end of the stops."""
        places = np.zeros(self._clearances.scene.distance_rate_bounds.shape[1])
        for columns, stop in zip(self._columns, self.stops, strict=True):
            if stop is not None:
                places[columns] = stop.end
        return places


class Neighbours:
    """View of the other arms for one arm; use it in the arm's loop, holding :attr:`lock`."""

    def __init__(self, arms: MovingArms, number: int) -> None:
        self._arms, self._number = arms, number
        self.lock = arms.lock

    @property
    def version(self) -> int:
        """Version number of the scene in use."""
        return self._arms.version

    def least(self, stop: Plan, begin: float, within: float) -> LeastClearance:
        """Return the least distance in [m] to the others on a stop, while they stop too."""
        return self._arms.least(self._number, stop, begin, within)

    def stops(self, plan: Plan, begin: float) -> None:
        """Share the stop after a step with the other arms."""
        self._arms.stops[self._number] = _Stop.of(plan, begin)

    def stands(self, state: RobotState | None) -> None:
        """Share the arm's position with the others while something else may move it."""
        self._arms.stops[self._number] = None if state is None else _Stop(state.position)
