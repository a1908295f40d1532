# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether the board has begun anew, and counts its yaw from another heading than before."""

from __future__ import annotations

import math

from ..report import DEVICE_TIME_WRAP, Report

LARGEST_LAG = 1.0  # [s] by which reports of one life of the board come late, or after each other
BOOT_TIME = 0.5  # [s] without a report is no shorter while the board boots


class BoardWatch:
    """Compares each report with the one before.

    Where the board reports its clock, the clock tells. Elsewhere each silence that is long enough
    for a restart counts as one: nothing was sent meanwhile, so the robot did not walk.
    """

    def __init__(self) -> None:
        """Begin without a report."""
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
        return abs(passed - gap) > LARGEST_LAG or passed < 0.0 < gap - BOOT_TIME
