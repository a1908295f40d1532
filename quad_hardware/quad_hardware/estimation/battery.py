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
    """State of the battery.

    Attributes:
        charge: [%]; None while unknown.
        voltage: [V]; None where it is not reported.
    """

    charge: float | None = None
    voltage: float | None = None


class BatteryFilter:
    """Takes the median of the last reports."""

    def __init__(self) -> None:
        """Begin without a report."""
        self._charges: deque[float] = deque(maxlen=REPORTS)
        self._voltages: deque[float] = deque(maxlen=REPORTS)

    def take(self, state: Report) -> None:
        """Take a report; charges that cannot be do not count."""
        if state.battery is not None and EMPTY <= state.battery <= FULL:
            self._charges.append(state.battery)
        if state.voltage is not None:
            self._voltages.append(state.voltage)

    @property
    def state(self) -> Battery:
        """The state of the battery now; may be asked for from any thread."""
        charges, voltages = self._charges.copy(), self._voltages.copy()
        return Battery(
            median(charges) if charges else None,
            median(voltages) if voltages else None,
        )
