# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A jog command while it is fresh, and the stop behind it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from arm_model import Array, RobotModel, RobotState

from ..report import MotionReport
from .servo_source import Command, ServoSettings, ServoSource, TwistCommand

REST_SPEED_FACTOR = 0.02
"""Share of a joint's speed below which a released jog needs no line any more."""

MAX_SLOW_DOWN_TIME = 1.0
"""Longest time for which a released jog is slowed down along its line in [s]."""


class Jogging:
    """Joint speeds for the latest jog command; none when it is stale and its stop is over."""

    def __init__(self, model: RobotModel, settings: ServoSettings) -> None:
        self._servo = ServoSource(model, settings)
        self._limits = model.limits
        self._command: Command | None = None
        self._fresh_until = 0.0
        self._slowing_since: float | None = None

    def begin(self) -> None:
        """Begin to jog: nothing is held yet."""
        self._servo.reset()

    def end(self) -> None:
        """Give the arm away."""
        self._command = None

    def take(self, command: Command, fresh_until: float) -> None:
        """Set the command.

        Args:
            fresh_until: Steady time until which it counts in [s].
        """
        self._command, self._fresh_until, self._slowing_since = command, fresh_until, None

    def stale(self, now: float) -> bool:
        """Whether no command counts any more."""
        return self._command is None or now > self._fresh_until

    def step(
        self, state: RobotState, now: float, period: float, *, held: bool
    ) -> tuple[Array | None, MotionReport]:
        """Return joint speeds in [rad/s] and what limits them; None to come to rest."""
        command = self._command
        if held or self.stale(now):
            command = self._slowing(state, now)
        if command is None:
            self._servo.reset()
            return None, MotionReport()
        answer = self._servo.step(state, command, period)
        return answer.velocity, answer.report

    def _slowing(self, state: RobotState, now: float) -> Command | None:
        """Return what slows a stale jog down along its line; None for the last of it."""
        calm = np.all(np.abs(state.velocity) < REST_SPEED_FACTOR * self._limits.velocity)
        if calm or not isinstance(self._command, TwistCommand):
            return None
        if self._slowing_since is None:
            self._slowing_since = now
        if now - self._slowing_since > MAX_SLOW_DOWN_TIME:
            return None
        return replace(self._command, twist=np.zeros(6))
