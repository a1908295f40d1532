# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The charge of the battery, without the one damaged report that would lay the robot down."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from statistics import median

from ..report import Report

REPORTS = 25  # that the median is taken of: half a second
EMPTY, FULL = 0.0, 100.0  # [%]
LOW_BATTERY, EMPTY_BATTERY = 20.0, 10.0  # [%] below which it is to be charged, and useless


@dataclass(frozen=True, slots=True)
class Battery:
    """State of the battery."""

    charge: float | None = None  # [%]; None while unknown
    voltage: float | None = None  # [V]; None where it is not reported


class BatteryFilter:
    """Takes the median of the last reports.

    Attributes:
        state: The state of the battery by now.
    """

    def __init__(self) -> None:
        self.state = Battery()
        self._charges: deque[float] = deque(maxlen=REPORTS)
        self._voltages: deque[float] = deque(maxlen=REPORTS)

    def take(self, report: Report) -> Battery:
        """Take a report, whose charge does not count when it cannot be; return the new state."""
        if report.battery is not None and EMPTY <= report.battery <= FULL:
            self._charges.append(report.battery)
        if report.voltage is not None:
            self._voltages.append(report.voltage)
        self.state = Battery(
            median(self._charges) if self._charges else None,
            median(self._voltages) if self._voltages else None,
        )
        return self.state
