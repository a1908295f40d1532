# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""When a report was made, on our clock: its arrival, without the jitter of the way."""

from __future__ import annotations

import math

from ..link.state import DEVICE_TIME_WRAP, RobotState

DRIFT = 1e-4  # share by which the robot's clock may be off
RESTART = 1.0  # [s] a difference beyond that is a robot that began anew


class SampleClock:
    """Maps the clock of the robot to ours by the fastest report so far.

    No report arrives before it was made, so the least difference of both clocks is the best; it
    is let grow slowly, for clocks drift. Without a clock in the report, its arrival counts, less
    half the time it was on the line.
    """

    def __init__(self) -> None:
        """Begin without a report."""
        self._offset = math.inf
        self._device = 0.0
        self._wraps = 0

    def time(self, state: RobotState) -> float:
        """Return when a report was made [s], on the clock of its arrival."""
        begun = state.arrival - state.wire_time
        if state.device_time is None:
            return state.arrival - state.wire_time / 2
        if self._device - state.device_time > DEVICE_TIME_WRAP / 2:
            self._wraps += 1
        elapsed, self._device = state.device_time - self._device, state.device_time
        device = state.device_time + self._wraps * DEVICE_TIME_WRAP
        offset = begun - device
        if abs(offset - self._offset) > RESTART:
            self._offset = offset
        self._offset = min(self._offset + max(elapsed, 0.0) * DRIFT, offset)
        return device + self._offset
