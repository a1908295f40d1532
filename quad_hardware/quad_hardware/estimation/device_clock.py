# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The clock of the board: when a report was made, on ours, and whether the board began anew."""

from __future__ import annotations

import math

from ..report import DEVICE_TIME_WRAP, Report

DRIFT = 1e-4  # share by which the robot's clock may be off
RESTART = 1.0  # [s] a difference beyond that is a robot that began anew
LATE = 0.1  # [s] a report that is later than others by that may be right, and they wrong
LATE_TIMEOUT = 0.5  # [s] for which all reports are late, until they are believed
MAX_LAG = 1.0  # [s] by which reports of one run of the board come late, or after each other
BOOT_TIME = 0.5  # [s] without a report is no shorter while the board boots


class SampleClock:
    """Maps the clock of the robot to ours by the fastest report so far.

    No report arrives before it was made, so the least difference of both clocks is the best; it
    is let grow slowly, for clocks drift. When all of them are late for a while, the one that was
    quicker was damaged, and is forgotten. Without a clock in the report, its arrival counts, less
    half the time it was on the line.
    """

    def __init__(self) -> None:
        self._offset = math.inf
        self._device = 0.0
        self._wraps = 0
        self._late_since = math.inf

    def time(self, state: Report) -> float:
        """Return when a report was made [s], on the clock of its arrival."""
        begun = state.arrival - state.wire_time
        if state.device_time is None:
            return state.arrival - state.wire_time / 2
        if self._device - state.device_time > DEVICE_TIME_WRAP / 2:
            self._wraps += 1
        elapsed, self._device = state.device_time - self._device, state.device_time
        device = state.device_time + self._wraps * DEVICE_TIME_WRAP
        offset = begun - device
        if abs(offset - self._offset) > RESTART or self._is_long_late(offset, begun):
            self._offset = offset
        self._offset = min(self._offset + max(elapsed, 0.0) * DRIFT, offset)
        return device + self._offset

    def _is_long_late(self, offset: float, begun: float) -> bool:
        if offset - self._offset <= LATE:
            self._late_since = math.inf
            return False
        self._late_since = min(self._late_since, begun)
        return begun - self._late_since > LATE_TIMEOUT


class BoardWatch:
    """Finds restarts, after which the board counts its yaw from another heading than before.

    Each report is compared with the one before. Where the board reports its clock, the clock
    shows it. Elsewhere each silence that is long enough for a restart counts as one: nothing was
    sent meanwhile, so the robot did not walk.
    """

    def __init__(self) -> None:
        self._last: Report | None = None

    def restarted(self, state: Report) -> bool:
        """Take a report; return whether the board has, or may have, begun anew before it."""
        last, self._last = self._last, state
        if last is None:
            return False
        gap = state.arrival - last.arrival
        if last.device_time is None or state.device_time is None:
            return gap > BOOT_TIME
        passed = math.remainder(state.device_time - last.device_time, DEVICE_TIME_WRAP)
        return abs(passed - gap) > MAX_LAG or passed < 0.0 < gap - BOOT_TIME
