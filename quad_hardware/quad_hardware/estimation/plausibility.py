# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reports that cannot be: an eight-bit checksum lets one damaged frame in 256 through."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace
import math

from ..joints.mapping import SERVO_REACH
from ..link.state import DEVICE_TIME_WRAP, RobotState

LARGEST_SPEED = 3000.0  # [deg/s] of a servo
LARGEST_ACCELERATION = 200.0  # [m/s²]
LARGEST_JUMP = 60.0  # [deg] between reports; a servo does 12 degrees in 20 ms
LARGEST_LAG = 0.1  # [s] between the robot's clock and ours from one report to the next
JUMP_TIME = 0.1  # [s] after which anything may have happened
PATIENCE = 2  # reports in a row that are refused for a jump, before it is believed


class Plausibility:
    """Says what is wrong with a report, if anything, as far as the robot has these motors."""

    def __init__(self, motors: Collection[int]) -> None:
        """Begin without a report.

        Args:
            motors: Ids of those that a joint uses; what the others report is nothing.
        """
        self._motors = frozenset(motors)
        self._last: RobotState | None = None
        self._refused = 0

    def check(self, state: RobotState) -> str:
        """Return why a report cannot be; empty when it can."""
        state = self._of_motors(state)
        reason = next(_impossible(state), '')
        if reason:
            return reason
        last = self._last
        if last is not None and state.arrival - last.arrival < JUMP_TIME:
            reason = next(_jumps(last, state), '')
        if reason and self._refused < PATIENCE:
            self._refused += 1
            return reason
        self._refused = 0
        self._last = state
        return ''

    def _of_motors(self, state: RobotState) -> RobotState:
        used = self._motors
        return replace(
            state,
            positions={m: angle for m, angle in state.positions.items() if m in used},
            velocities={m: speed for m, speed in state.velocities.items() if m in used},
        )


def _impossible(state: RobotState) -> Iterator[str]:
    felt = state.acceleration or (0.0, 0.0, 0.0)
    numbers = (*state.attitude, *felt, *state.positions.values())
    if not all(map(math.isfinite, (*numbers, *state.velocities.values()))):
        yield 'a number is not finite'
    if math.hypot(*felt) > LARGEST_ACCELERATION:
        yield f'acceleration {felt} m/s²'
    if any(abs(angle) > 360.0 for angle in state.attitude):
        yield f'attitude {state.attitude} deg'
    for motor, angle in state.positions.items():
        if abs(angle) > SERVO_REACH:
            yield f'motor {motor} at {angle:.4g} deg'
    for motor, speed in state.velocities.items():
        if abs(speed) > LARGEST_SPEED:
            yield f'motor {motor} at {speed:.4g} deg/s'


def _jumps(last: RobotState, state: RobotState) -> Iterator[str]:
    for motor, angle in state.positions.items():
        if abs(angle - last.positions.get(motor, angle)) > LARGEST_JUMP:
            yield f'motor {motor} jumped to {angle:.4g} deg'
    for name, before, now in zip('rpy', last.attitude, state.attitude, strict=True):
        if abs(math.remainder(now - before, 360.0)) > LARGEST_JUMP:
            yield f'attitude {name} jumped to {now:.4g} deg'
    if last.device_time is not None and state.device_time is not None:
        passed = math.remainder(state.device_time - last.device_time, DEVICE_TIME_WRAP)
        if abs(passed - (state.arrival - last.arrival)) > LARGEST_LAG:
            yield f'the clock of the robot went on by {passed:.3f} s'
