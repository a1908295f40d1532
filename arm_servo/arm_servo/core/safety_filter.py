# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The last word on every set-point: the arm can always still stop within its limits."""

from __future__ import annotations

import numpy as np

from arm_model import Array, LeastClearance, Mask, RobotModel, RobotState
from arm_trajectory import hard_brake, OnlineTrajectoryGenerator, Plan

from ..report import Cause, Limiter

CONTACT_TOLERANCE = 1e-4
"""Change of a distance that is let pass, in all, in [m]: sliding along is no approach."""

MIN_SAMPLES, MAX_SAMPLES = 6, 40
"""How many places of a stop distances are looked at, at least and at most."""

MAX_STRIDE = 0.1
"""Way of all joints between two looks in [rad]."""

ROUNDING_TOLERANCE = 1e-7
"""Rounding of ruckig's positions that is let pass in [rad]."""


class SafetyFilter:
    """Lets a step pass only when the shortest stop behind it stays within the limits.

    A joint that could not stop any more brakes instead; where links would come too near, all do.
    As the step before has passed, there is always a stop to fall back on. An arm that begins
    beyond a limit, or in contact, may go back and may not go further.
    """

    def __init__(self, model: RobotModel, generator: OnlineTrajectoryGenerator) -> None:
        """Prepare.

        Args:
            model: The arm.
            generator: Plans its stops.
        """
        self._model = model
        self._limits = model.limits
        self._generator = generator
        self._clearance = 0.0  # for which the floor was found
        self._lower: Array = model.limits.lower
        self._upper: Array = model.limits.upper
        self._anywhere: Array = np.full(len(model), np.inf)
        self._floor: float | None = None
        self._fastest: Array = model.limits.velocity * (1.0 + 1e-6)

    def reset(self, state: RobotState) -> None:
        """Begin at a state.

        Args:
            state: Where the arm is.
        """
        stop = self._generator.brake(state)
        self._lower, self._upper = -self._anywhere, self._anywhere
        self._floor = None
        if stop is not None:
            self._remember(stop)

    def forget(self) -> None:
        """Measure anew how near links may be: what may collide has changed."""
        self._floor = None

    def step(
        self, state: RobotState, wanted: RobotState, period: float, clearance: float | None
    ) -> tuple[RobotState, Limiter | None]:
        """Let a step pass, or brake instead.

        Args:
            state: Commanded state now.
            wanted: State wanted at the end of the period.
            period: Its length in [s].
            clearance: Least distance between links on a stop in [m]; None where what moves the
                arm keeps to a path that was checked.

        Returns:
            The state to command, and what held the wanted one up.
        """
        beyond, stop = self._beyond(wanted)
        limiter = None
        if beyond.any():  # these joints brake, each for itself; the others go on
            limiter = self._limit(wanted, int(np.argmax(beyond)))
            wanted = _mixed(beyond, self._brake(state, period), wanted)
            beyond, stop = self._beyond(wanted)
        if stop is not None and not beyond.any():
            near = self._too_near(stop, state, clearance)
            if near is None:
                self._remember(stop)
                return wanted, limiter
            limiter = Limiter(Cause.COLLISION, ' - '.join(near.links), near.distance, 0.0)
            eased = self._eased(state, period)
            if eased is not None:
                return eased, limiter
        return self._brake(state, period), limiter

    def _beyond(self, wanted: RobotState) -> tuple[Mask, Plan | None]:
        """Return which joints could not stop any more within their limits, and how all would."""
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
        lower, upper = stop.extremes
        self._lower = np.minimum(self._limits.lower, np.maximum(self._lower, lower))
        self._upper = np.maximum(self._limits.upper, np.minimum(self._upper, upper))

    def _too_near(
        self, stop: Plan, state: RobotState, clearance: float | None
    ) -> LeastClearance | None:
        """Return which links a stop would bring too near, and how near; None for none.

        Links that are nearer than they should be may stay as they are, not come nearer.
        """
        if clearance is None:
            self._floor = None
            return None
        if clearance != self._clearance:
            self._clearance, self._floor = clearance, None
        if self._floor is None:
            now = self._generator.brake(state)
            self._floor = clearance if now is None else self._least(now).distance
            self._floor = min(self._floor, clearance)
        near = self._least(stop)
        if near.distance < self._floor - CONTACT_TOLERANCE:
            # what stopping now brings about cannot be had better
            now = self._generator.brake(state)
            least = self._floor - CONTACT_TOLERANCE
            least = least if now is None else min(self._floor, self._least(now).distance)
            self._floor = min(self._floor, least + CONTACT_TOLERANCE)
        if near.distance < self._floor - CONTACT_TOLERANCE - ROUNDING_TOLERANCE:
            return near
        self._floor = max(self._floor, min(near.distance, clearance))
        return None

    def _least(self, stop: Plan) -> LeastClearance:
        """Return the least distance between links on a stop, if it is small."""
        if self._model.stays_apart(*stop.extremes, self._clearance):
            return LeastClearance(self._clearance)
        way = np.ptp(np.stack(stop.extremes), axis=0).sum()
        looks = min(max(MIN_SAMPLES, round(way / MAX_STRIDE)), MAX_SAMPLES)
        times = np.linspace(0.0, stop.duration, looks + 1)[1:].tolist()
        places = np.array([stop.at(time).position for time in times])
        return self._model.least_clearance(places, self._clearance)

    def _eased(self, state: RobotState, period: float) -> RobotState | None:
        """Brake with the joints in step, which keeps the direction, where that is clear too."""
        plan = self._generator.to_velocity(state, np.zeros(len(self._limits)))
        if plan is None or self._floor is None or period >= plan.duration:
            return None
        after = plan.at(period)
        beyond, stop = self._beyond(after)
        if (
            stop is None
            or beyond.any()
            or self._least(plan).distance < self._floor - CONTACT_TOLERANCE
        ):
            return None
        self._remember(stop)
        return after

    def _brake(self, state: RobotState, period: float) -> RobotState:
        stop = self._generator.brake(state)
        if stop is None:
            return hard_brake(state, self._limits, period)
        if period >= stop.duration:
            return RobotState.at_rest(stop.at(stop.duration).position)
        return stop.at(period)


def _mixed(mask: Mask, one: RobotState, other: RobotState) -> RobotState:
    """Return one state where a mask says so, and the other elsewhere."""
    return RobotState(
        np.where(mask, one.position, other.position),
        np.where(mask, one.velocity, other.velocity),
        np.where(mask, one.acceleration, other.acceleration),
    )
