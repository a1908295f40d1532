# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How fast each joint may move now: in front of its limits, and of near pairs of links."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from arm_model import Array, Proximity, RobotModel, RobotState
from arm_trajectory import brakeable

from ..report import Cause, Limiter

ACTIVE_FORCE = 1e-9  # force of a bound above which it counts as pressing

MIN_DECELERATION_FACTOR = 0.3
"""Least share of its deceleration that a joint plans with while others take longer to stop."""

MIN_APPROACH_CYCLES = 3.0  # least time for the rest of the way to a limit, in cycles


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


@dataclass(slots=True, eq=False)
class Bounds:
    """Bounds of the joint speeds in a state."""

    ways: Sequence[tuple[float, float]]  # left to the lower and upper limits, less the margins
    # least and greatest speeds that can be braked in front of the limits in [rad/s]
    brakeable: Sequence[tuple[float, float]]
    lower: Array  # those, and what can be reached soon, in [rad/s]
    upper: Array  # those, and what can be reached soon, in [rad/s]
    near: Sequence[Proximity]  # the nearest pairs of links
    rows: Array  # their gradients (m, n) in [m/rad]
    least: Array  # their least changes of distance (m) in [m/s]


class VelocityBounds:
    """Finds the bounds of an arm's joint speeds."""

    def __init__(self, model: RobotModel, settings: VelocityBoundsSettings) -> None:
        limits = model.limits
        self._model, self._settings, self._limits = model, settings, limits
        margins = np.array(settings.joint_margins)
        change = 1.5 * limits.acceleration**2 / limits.jerk + 0.01 * limits.acceleration
        # plain numbers by joint, as an array of few is slower than its numbers one by one
        self._joints = list(
            zip(
                (limits.lower + margins).tolist(),
                (limits.upper - margins).tolist(),
                limits.velocity.tolist(),
                limits.acceleration.tolist(),
                limits.jerk.tolist(),
                # what a speed can change by while its acceleration builds up and down, and more
                change.tolist(),
                strict=True,
            )
        )
        self._nothing = np.empty((0, len(limits))), np.empty(0)

    def bounds(self, state: RobotState, period: float) -> Bounds:
        """Find the bounds in a state."""
        settings = self._settings
        near = self._model.nearest(state.position, settings.horizon, settings.pairs)
        velocities, accelerations = state.velocity.tolist(), state.acceleration.tolist()
        longest = max(
            abs(velocity) / joint[3]
            for velocity, joint in zip(velocities, self._joints, strict=True)
        )
        last = MIN_APPROACH_CYCLES * period  # the last of the way is not run through in a cycle
        ways, both, lowest, highest = [], [], [], []
        for position, velocity, acceleration, joint in zip(
            state.position.tolist(), velocities, accelerations, self._joints, strict=True
        ):
            lower, upper, fastest, deceleration, jerk, change = joint
            below, above = position - lower, upper - position
            # all joints brake in step, so that the tool keeps its direction
            part = abs(velocity) / deceleration / longest if longest > 0.0 else 1.0
            share = settings.braking * max(part, MIN_DECELERATION_FACTOR)
            slowed, jerked = deceleration * share, jerk * share
            left = below - _lead(-velocity, -acceleration, jerk)
            down = _speed(left, slowed, jerked, min(fastest, left / last))
            left = above - _lead(velocity, acceleration, jerk)
            up = _speed(left, slowed, jerked, min(fastest, left / last))
            ways.append((below, above))
            both.append((-down, up))
            lowest.append(min(max(-down, velocity - change), up))
            highest.append(max(min(up, velocity + change), -down))
        lower_bounds, upper_bounds = np.array(lowest), np.array(highest)
        rows, least = self._nothing
        if near:
            rows = np.array([pair.gradient for pair in near])
            # no more than can be had soon: a fast approach is braked as hard as can be
            best = np.maximum(rows, 0.0) @ upper_bounds + np.minimum(rows, 0.0) @ lower_bounds
            allowed = [
                -settings.approach * max(pair.distance - settings.margin, 0.0) for pair in near
            ]
            least = np.minimum(allowed, best)
        return Bounds(ways, both, lower_bounds, upper_bounds, near, rows, least)

    def pressing(self, bounds: Bounds, forces: Sequence[float], factor: float) -> list[Limiter]:
        """Name the bounds and rows that press, the strongest first.

        Args:
            forces: How hard the bounds (n) and the rows (m) press, with the sense of the bound.
        """
        count, share = len(self._limits), min(max(factor, 0.0), 1.0)
        pressing = [place for place, force in enumerate(forces) if abs(force) > ACTIVE_FORCE]
        found = []
        for place in sorted(pressing, key=lambda each: -abs(forces[each])):
            if place >= count:
                pair = bounds.near[place - count]
                name = ' - '.join(pair.links)
                found.append(Limiter(Cause.COLLISION, name, pair.distance, share))
            else:
                found.append(self._bound(bounds, place, forces[place] > 0.0, share))
        return found

    def _bound(self, bounds: Bounds, joint: int, rising: bool, share: float) -> Limiter:
        """Name the limit behind a bound."""
        name, velocity = self._limits.names[joint], self._joints[joint][2]
        bound = float(bounds.upper[joint] if rising else -bounds.lower[joint])
        fastest = bounds.brakeable[joint][1] if rising else -bounds.brakeable[joint][0]
        if bound < fastest - ACTIVE_FORCE:
            return Limiter(Cause.JOINT_ACCELERATION, name, bound, share)
        if fastest >= velocity:
            return Limiter(Cause.JOINT_VELOCITY, name, bound, share)
        return Limiter(Cause.JOINT_POSITION, name, bounds.ways[joint][rising], share)


def _lead(velocity: float, acceleration: float, jerk: float) -> float:
    """Return the way that goes by while an acceleration is taken back."""
    if acceleration <= 0.0:
        return 0.0
    time = acceleration / jerk
    return (max(velocity, 0.0) + acceleration * time / 3.0) * time


def _speed(way: float, deceleration: float, jerk: float, fastest: float) -> float:
    """Return the speed that can be braked within a way, at most the fastest."""
    if way <= 0.0:
        return 0.0
    if fastest * (fastest / deceleration + deceleration / jerk) < 2.0 * way:
        return fastest  # the stop from there is shorter
    return min(brakeable(way, deceleration, jerk), fastest)
