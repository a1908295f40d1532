# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The last word on every set-point: the arm can always still stop within its limits."""

from __future__ import annotations

import numpy as np

from .arrays import Array
from .model import RobotModel
from .otg import Generator, hard_brake, MotionState, Plan
from .report import Cause, Limiter

EXACT = 1e-7
"""Rounding of ruckig's positions that is let pass in [rad]."""


class Guard:
    """Lets a step pass only when the shortest stop behind it stays within the limits.

    The stop behind the step that passed last is always known, so there is always one to fall back
    on. An arm that begins beyond a limit, or in contact, may go back and may not go further.
    """

    def __init__(self, model: RobotModel, generator: Generator, clearance: float) -> None:
        """Prepare.

        Args:
            model: The arm.
            generator: Plans its stops.
            clearance: Least distance between links at the end of a stop in [m].
        """
        self._model = model
        self._limits = model.limits
        self._generator = generator
        self._clearance = clearance
        self._stop: Plan | None = None
        self._lower: Array = model.limits.lower
        self._upper: Array = model.limits.upper
        self._anywhere: Array = np.full(len(model), np.inf)
        self._room = np.inf
        self._fastest: Array = model.limits.velocity * (1.0 + 1e-6)

    def reset(self, state: MotionState) -> None:
        """Begin at a state.

        Args:
            state: Where the arm is.
        """
        self._stop = self._generator.brake(state)
        self._lower, self._upper = -self._anywhere, self._anywhere
        self._remember(self._stop, self._distance(self._stop, np.inf))

    def step(
        self, state: MotionState, wanted: MotionState, period: float, clearances: bool
    ) -> tuple[MotionState, Limiter | None]:
        """Let a step pass, or brake instead.

        Args:
            state: Commanded state now.
            wanted: State wanted at the end of the period.
            period: Its length in [s].
            clearances: Whether distances between links count too.

        Returns:
            The state to command, and what held the wanted one up.
        """
        stop = self._generator.brake(wanted)
        if stop is not None:
            reason = self._overspeed(wanted) or self._refusal(state, stop, clearances)
            if reason is None:
                self._stop = stop
                return wanted, None
        else:
            reason = 'no stop behind it'
        return self._brake(state, period), Limiter(Cause.STOP_CHECK, reason, 0.0, 0.0)

    def _overspeed(self, wanted: MotionState) -> str | None:
        """Return the joint that would overrun its speed before its acceleration is taken back."""
        coasting = wanted.acceleration * np.abs(wanted.acceleration) / (2.0 * self._limits.jerk)
        peak = np.maximum(np.abs(wanted.velocity + coasting), np.abs(wanted.velocity))
        beyond = peak > self._fastest
        return self._limits.names[int(np.argmax(beyond))] if beyond.any() else None

    def _refusal(self, state: MotionState, stop: Plan, clearances: bool) -> str | None:
        """Return why a stop is not good enough; remember it when it is."""
        lower, upper = stop.extremes
        beyond = (lower < self._lower - EXACT) | (upper > self._upper + EXACT)
        if beyond.any():
            return self._limits.names[int(np.argmax(beyond))]
        room = self._room_of(stop, state) if clearances else self._room
        if clearances and room < min(self._room, self._clearance):
            return 'distance of links'
        self._remember(stop, room)
        return None

    def _remember(self, stop: Plan | None, room: float) -> None:
        """Allow as much beyond the limits as the present stop needs, and no more."""
        self._room = room
        if stop is None:
            return
        lower, upper = stop.extremes
        self._lower = np.minimum(self._limits.lower, np.maximum(self._lower, lower))
        self._upper = np.maximum(self._limits.upper, np.minimum(self._upper, upper))

    def _distance(self, stop: Plan | None, default: float) -> float:
        """Return the least distance between links where a stop ends in [m]."""
        return default if stop is None else self._model.clearance(stop.at(stop.duration).position)

    def _room_of(self, stop: Plan, state: MotionState) -> float:
        """Return the distance of links where a stop ends, or a lower bound that is enough.

        No point of the arm moves farther than the joints turn times its reach, a pair of links not
        farther apart or together than twice that.
        """
        lower, upper = stop.extremes
        turn = float(np.maximum(upper - state.position, state.position - lower).sum())
        bound = self._model.seen_clearance(state.position) - 2.0 * turn * self._model.reach
        return bound if bound > self._clearance else self._distance(stop, np.inf)

    def _brake(self, state: MotionState, period: float) -> MotionState:
        stop = self._generator.brake(state)
        if stop is None:
            return hard_brake(state, self._limits, period)
        if period >= stop.duration:
            return MotionState.at_rest(stop.at(stop.duration).position)
        return stop.at(period)
