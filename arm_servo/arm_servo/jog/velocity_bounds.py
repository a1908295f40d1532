# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How fast each joint may move now: in front of its limits, and of near pairs of links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arm_model import Array, frozen, Proximity, RobotModel, RobotState
from arm_trajectory import brakeable

from ..report import Cause, Limiter

ACTIVE_FORCE = 1e-9  # force of a bound above which it counts as pressing

MIN_DECELERATION_FACTOR = 0.3
"""Least share of its deceleration that a joint plans with while others take longer to stop."""

MIN_APPROACH_CYCLES = 3.0  # least time for the rest of the way to a limit, in cycles
SIGNS = np.array([[-1.0], [1.0]])  # signs of the two ways of a joint


@dataclass(frozen=True, slots=True)
class VelocityBoundsSettings:
    """How motion brakes in front of limits."""

    margin: float = 0.01  # least distance between links that a command may bring about in [m]
    horizon: float = 0.15  # distance at which a pair of links is taken into account in [m]
    pairs: int = 3  # greatest number of pairs taken into account
    approach: float = 4.0  # greatest speed of approach per distance to the margin in [1/s]
    # share of acceleration and jerk that braking in front of a limit plans with
    braking: float = 0.7
    # distance from the position limits at which joints come to rest in [rad], one for all or one
    # each
    joint_margins: tuple[float, ...] = (0.0,)


@dataclass(frozen=True, slots=True, eq=False)
class Bounds:
    """Bounds of the joint speeds in a state."""

    below: Array  # ways left to the lower limits, less the margins, in [rad]
    above: Array  # ways left to the upper limits, less the margins, in [rad]
    slowest: Array  # least speeds that can be braked in front of the lower limits in [rad/s]
    fastest: Array  # greatest speeds that can be braked in front of the upper limits in [rad/s]
    lower: Array  # those, and what can be reached soon, in [rad/s]
    upper: Array  # those, and what can be reached soon, in [rad/s]
    near: Sequence[Proximity]  # the nearest pairs of links
    rows: Array  # their gradients (m, n) in [m/rad]
    least: Array  # their least changes of distance (m) in [m/s]


class VelocityBounds:
    """Finds the bounds of an arm's joint speeds."""

    def __init__(self, model: RobotModel, settings: VelocityBoundsSettings) -> None:
        limits, share = model.limits, settings.braking
        self._model, self._settings, self._limits = model, settings, limits
        self._share = share
        margins = np.array(settings.joint_margins)
        self._lower, self._upper = limits.lower + margins, limits.upper - margins
        # what a speed can change by while its acceleration builds up and down, and a little more
        self._change = frozen(
            1.5 * limits.acceleration**2 / limits.jerk + 0.01 * limits.acceleration
        )

    def bounds(self, state: RobotState, period: float) -> Bounds:
        """Find the bounds in a state."""
        settings, limits = self._settings, self._limits
        near = self._model.nearest(state.position, settings.horizon, settings.pairs)
        ways = np.array((state.position - self._lower, self._upper - state.position))
        below, above = ways
        left = np.maximum(ways - self._lead(state), 0.0)
        share = self._in_step(state)
        speed = brakeable(left, limits.acceleration * share, limits.jerk * share)
        # the last of the way is not run through in a cycle
        speed = np.minimum(
            np.minimum(speed, limits.velocity), left / (MIN_APPROACH_CYCLES * period)
        )
        slowest, fastest = speed * SIGNS
        lower = np.minimum(np.maximum(slowest, state.velocity - self._change), fastest)
        upper = np.maximum(np.minimum(fastest, state.velocity + self._change), slowest)
        rows = np.array([pair.gradient for pair in near]).reshape(len(near), len(limits))
        allowed = np.array(
            [-settings.approach * max(pair.distance - settings.margin, 0.0) for pair in near]
        )
        # no more than can be had soon: a fast approach is braked as hard as can be
        best = np.maximum(rows, 0.0) @ upper + np.minimum(rows, 0.0) @ lower
        least = np.minimum(allowed, best)
        return Bounds(below, above, slowest, fastest, lower, upper, near, rows, least)

    def _in_step(self, state: RobotState) -> Array:
        """Return the shares of acceleration and jerk with which all joints brake in step.

        The tool keeps its direction then.
        """
        times = np.abs(state.velocity) / self._limits.acceleration
        longest = float(times.max())
        part = times / longest if longest > 0.0 else np.ones_like(times)
        share: Array = self._share * np.maximum(part, MIN_DECELERATION_FACTOR)
        return share

    def _lead(self, state: RobotState) -> Array:
        """Return the way down and up that goes by while an acceleration is taken back (2, n)."""
        acceleration = np.maximum(SIGNS * state.acceleration, 0.0)
        velocity = np.maximum(SIGNS * state.velocity, 0.0)
        time = acceleration / self._limits.jerk
        lead: Array = (velocity + acceleration * time / 3.0) * time
        return lead

    def pressing(self, bounds: Bounds, forces: Array, factor: float) -> list[Limiter]:
        """Name the bounds and rows that press, the strongest first.

        Args:
            forces: How hard the bounds (n) and the rows (m) press, with the sense of the bound.
        """
        count, share = len(self._limits), min(max(factor, 0.0), 1.0)
        found = []
        strength = np.abs(forces)
        for place in sorted(
            np.flatnonzero(strength > ACTIVE_FORCE), key=lambda each: -strength[each]
        ):
            if place >= count:
                pair = bounds.near[place - count]
                name = ' - '.join(pair.links)
                found.append(Limiter(Cause.COLLISION, name, pair.distance, share))
            else:
                found.append(self._bound(bounds, int(place), bool(forces[place] > 0), share))
        return found

    def _bound(self, bounds: Bounds, joint: int, rising: bool, share: float) -> Limiter:
        """Name the limit behind a bound."""
        name = self._limits.names[joint]
        if rising:
            bound, fastest, way = bounds.upper, bounds.fastest, bounds.above
        else:
            bound, fastest, way = -bounds.lower, -bounds.slowest, bounds.below
        if bound[joint] < fastest[joint] - ACTIVE_FORCE:
            return Limiter(Cause.JOINT_ACCELERATION, name, float(bound[joint]), share)
        if fastest[joint] >= self._limits.velocity[joint]:
            return Limiter(Cause.JOINT_VELOCITY, name, float(bound[joint]), share)
        return Limiter(Cause.JOINT_POSITION, name, float(way[joint]), share)
