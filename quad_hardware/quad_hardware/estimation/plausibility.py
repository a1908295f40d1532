# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Reports that cannot be: an eight-bit checksum lets one damaged frame in 256 through."""

from __future__ import annotations

from collections.abc import Collection
import math

from ..joints.mapping import SERVO_REACH
from ..report import DEVICE_TIME_WRAP, Report

MAX_SPEED = 3000.0  # [deg/s] of a servo
MAX_ACCELERATION = 200.0  # [m/s²]
MAX_JUMP = 60.0  # [deg] between reports; a servo does 12 degrees in 20 ms
MAX_LAG = 0.1  # [s] between the robot's clock and ours from one report to the next
JUMP_TIME = 0.1  # [s] after which anything may have happened
NOT_FINITE = 'a number is not finite'
MAX_REFUSALS = 2  # doubtful reports in a row that are refused, before they are believed


class Plausibility:
    """Says what is wrong with a report, if anything, as far as the robot has these motors.

    A jump, or an IMU that reports what cannot be, may be a damaged frame; when it lasts it is so.
    Joints that cannot be are never believed.

    Attributes:
        imu_problem: Why attitude and acceleration of the last report that could be are of no use;
            empty while the IMU works.
    """

    def __init__(self, motors: Collection[int]) -> None:
        """Begin without a report.

        Args:
            motors: Ids of those that a joint uses; what the others report is nothing.
        """
        self._motors = tuple(motors)
        self._last: Report | None = None
        self._refused = 0
        self.imu_problem = ''

    def check(self, state: Report) -> str:
        """Return why a report cannot be; empty when it can."""
        if reason := self._joint_problem(state):
            return reason
        imu, last = _imu_problem(state), self._last
        doubt = '' if self.imu_problem else imu
        if not doubt and last is not None and state.arrival - last.arrival < JUMP_TIME:
            doubt = self._jump(last, state, attitude=not (imu or self.imu_problem))
        if doubt and self._refused < MAX_REFUSALS:
            self._refused += 1
            return doubt
        self._refused = 0
        self._last, self.imu_problem = state, imu
        return ''

    def _joint_problem(self, state: Report) -> str:
        for name, values, most in (
            ('deg', state.positions, SERVO_REACH),
            ('deg/s', state.velocities, MAX_SPEED),
        ):
            for motor in self._motors:
                value = values.get(motor, 0.0)
                if not abs(value) <= most:
                    finite = math.isfinite(value)
                    return f'motor {motor} at {value:.4g} {name}' if finite else NOT_FINITE
        return ''

    def _jump(self, last: Report, state: Report, *, attitude: bool) -> str:
        for motor in self._motors:
            angle = state.positions.get(motor)
            if angle is None:
                continue
            if abs(angle - last.positions.get(motor, angle)) > MAX_JUMP:
                return f'motor {motor} jumped to {angle:.4g} deg'
        for name, before, now in zip('rpy', last.attitude, state.attitude, strict=True):
            if attitude and abs(math.remainder(now - before, 360.0)) > MAX_JUMP:
                return f'attitude {name} jumped to {now:.4g} deg'
        if last.device_time is not None and state.device_time is not None:
            passed = math.remainder(state.device_time - last.device_time, DEVICE_TIME_WRAP)
            if abs(passed - (state.arrival - last.arrival)) > MAX_LAG:
                return f'the clock of the robot went on by {passed:.3f} s'
        return ''


def _imu_problem(state: Report) -> str:
    felt = state.acceleration or (0.0, 0.0, 0.0)
    if not all(map(math.isfinite, (*state.attitude, *felt, *(state.rates or ())))):
        return f'imu: {NOT_FINITE}'
    if math.hypot(*felt) > MAX_ACCELERATION:
        return f'imu: acceleration {felt} m/s²'
    if max(map(abs, state.attitude)) > 360.0:
        return f'imu: attitude {state.attitude} deg'
    return ''
