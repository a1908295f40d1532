# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether an arm goes where it is sent, however late its drives and its joint states are."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from arm_model import Array, JointLimits

REST_TOLERANCE = 0.002
"""How far an arm at rest may turn by itself in [rad]; more was done by others."""

MEAN_GAIN = 0.1  # share of a new measurement in the mean and in the noise of an arm at rest

NOISE_ALLOWANCE, MEAN_ALLOWANCE = 8.0, 2.0
"""How many times its noise a measurement, and the mean of many, may be off by itself."""

ARRIVAL_TOLERANCE = 0.02
"""The same while it may still be on its last way, from all that was commanded."""


@dataclass(frozen=True, slots=True)
class FollowingLimits:
    """When an arm counts as not following."""

    error: float = 0.2  # how far a joint may be from where it was sent in [rad]; 0 is any distance
    delay: float = 0.2  # how late it may be there in [s]


class FollowingWatch:
    """Compares measured positions with all that was commanded during the delay.

    An arm that follows late is somewhere between these commands, so its error is zero at any
    speed; one that does not follow is left behind.
    """

    def __init__(self, joints: JointLimits, limits: FollowingLimits, period: float) -> None:
        self._joints = joints
        self._limits = limits
        self._commands = np.zeros((math.ceil(limits.delay / period) + 1, len(joints)))
        self._turn = 0
        self._quiet = math.ceil(limits.delay / period)
        self._still = 0
        self._rest = self._mean = self._last = self._commands[0]
        self._noise = np.zeros(len(joints))

    def begin(self, positions: Array) -> None:
        """Begin where the arm stands."""
        self._commands[:] = positions
        self._rest = self._mean = self._last = positions

    def command(self, positions: Array) -> None:
        """Note the command of a cycle."""
        self._turn = (self._turn + 1) % len(self._commands)
        self._commands[self._turn] = positions

    def errors(self, measured: Array) -> Array:
        """Return how far each joint is from all of its commands in [rad]."""
        measured = self._unwound(measured, self._commands[self._turn])
        lower, upper = self._commands.min(axis=0), self._commands.max(axis=0)
        errors: Array = np.maximum(np.maximum(lower - measured, measured - upper), 0.0)
        return errors

    def moved(self, measured: Array, *, quiet: bool) -> bool:
        """Whether others have moved the arm since it came to rest; once a cycle.

        Drives need not stand exactly where they were sent, so what counts is where they stood.
        Encoders are noisy: how much so is learned at rest.
        """
        self._still = self._still + 1 if quiet else 0
        if self._still <= 1:
            self._mean = self._last = measured
        allowed = np.maximum(REST_TOLERANCE, NOISE_ALLOWANCE * self._noise)
        self._learn(measured)
        if self._still <= self._quiet:
            self._rest = self._mean
            return quiet and bool(self.errors(measured).max() > ARRIVAL_TOLERANCE)
        aside = np.abs(self._unwound(measured, self._rest) - self._rest)
        drifted = np.abs(self._mean - self._rest)
        return bool(
            np.any(aside > allowed)
            or np.any(drifted > np.maximum(REST_TOLERANCE, MEAN_ALLOWANCE * self._noise))
        )

    def _learn(self, measured: Array) -> None:
        """Update the mean and the noise by a measurement."""
        near = self._unwound(measured, self._last)
        self._noise = self._noise + MEAN_GAIN * (np.abs(near - self._last) - self._noise)
        self._last = near
        self._mean = self._mean + MEAN_GAIN * (self._unwound(measured, self._mean) - self._mean)

    def _unwound(self, measured: Array, near: Array) -> Array:
        """Add whole turns to continuous joints."""
        return near - self._joints.error(near, measured)

    def problem(self, measured: Array) -> str:
        """Describe the joint that does not follow; empty when all do."""
        errors = self.errors(measured)
        worst = int(np.argmax(errors))
        if not 0.0 < self._limits.error < errors[worst]:
            return ''
        joint = self._joints.names[worst]
        return (
            f'{joint} does not follow: it is {errors[worst]:.3f} rad from where it was sent; does'
            ' its controller take set-points, and is its way free? Let go, and command again'
        )
