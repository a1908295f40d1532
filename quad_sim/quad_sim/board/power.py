# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Battery and temperatures, of which the figures are ours, and turning on the spot."""

from __future__ import annotations

from dataclasses import dataclass
import math

import numpy as np

from ..plant.state import Array

RATE = math.radians(60.0)  # [rad/s]
CLOSE = math.radians(2.0)  # [rad] from here on it counts as done: the last stride adds the rest
MAX_DURATION_RATIO = 3.0  # times the time that it should take; a robot that cannot turn gives up


class Turn:
    """A turn under way; over when :meth:`rate` is zero."""

    def __init__(self, angle: float, yaw: float, now: float) -> None:
        """Begin to turn.

        Args:
            angle: How far [rad]; counter-clockwise is positive, more than a turn is allowed.
            yaw: Heading now [rad].
        """
        self._left = angle
        self._yaw = yaw
        self._deadline = now + 1.0 + MAX_DURATION_RATIO * abs(angle) / RATE

    def rate(self, yaw: float, now: float) -> float:
        """Return how fast to turn [rad/s].

        Args:
            yaw: Heading now [rad], which may have wrapped around.
        """
        self._left -= math.remainder(yaw - self._yaw, 2.0 * math.pi)
        self._yaw = yaw
        if abs(self._left) < CLOSE or now > self._deadline:
            return 0.0
        return math.copysign(min(RATE, 2.0 * abs(self._left) + 0.2), self._left)


CAPACITY = 2.5 * 3600.0  # [A s] two 18650 cells in series (the vendor's page: 2500 mAh)
EMPTY, FULL = 6.4, 8.4  # [V] without load
RESISTANCE = 0.12  # [Ohm]
IDLE_CURRENT = 0.6  # [A] computer, board and idle servos
CURRENT_PER_TORQUE = 1.6  # [A/(N m)] 0.7 A at stall
AMBIENT = 25.0  # [degC]
HEATING = 55.0  # [K] above ambient of a servo that is held at stall for good
WARM_UP = 90.0  # [s]
LOW_BATTERY = 15.0  # [%]
HOT = 70.0  # [degC]
FULL_LOAD = 0.95  # share of the stall torque; a servo above for a while counts as overloaded
OVERLOAD_TIME = 1.0  # [s] a step of the gait is shorter


@dataclass(slots=True)
class Battery:
    """The battery."""

    charge: float = 100.0  # [%]
    current: float = IDLE_CURRENT  # what is drawn from it [A]

    def advance(self, torques: Array, duration: float) -> None:
        """Draw current for a time [s]."""
        self.current = IDLE_CURRENT + CURRENT_PER_TORQUE * float(np.abs(torques).sum())
        drained = 100.0 * self.current * duration / CAPACITY
        self.charge = max(self.charge - drained, 0.0)

    @property
    def percent(self) -> int:
        """Charge as the board reports it."""
        return round(self.charge)

    @property
    def voltage(self) -> float:
        """Voltage under load [V]."""
        return EMPTY + (FULL - EMPTY) * self.charge / 100.0 - RESISTANCE * self.current


class ServoThermalModel:
    """Temperatures of the servos, of first order in the square of their loads."""

    def __init__(self, count: int) -> None:
        self.temperatures: Array = np.full(count, AMBIENT)

    def advance(self, loads: Array, duration: float) -> None:
        """Warm up for a time [s] under loads (1: stall)."""
        goal = AMBIENT + HEATING * loads * loads
        self.temperatures += (goal - self.temperatures) * min(duration / WARM_UP, 1.0)


class Overload:
    """How long each servo has been held at its full torque; a foot that lands is no overload."""

    def __init__(self, count: int) -> None:
        self._since: Array = np.zeros(count)

    def advance(self, loads: Array, duration: float) -> None:
        """Be loaded for a time [s] (1: stall)."""
        self._since = np.where(np.abs(loads) > FULL_LOAD, self._since + duration, 0.0)

    @property
    def lasts(self) -> bool:
        """Whether a servo has been overloaded for too long."""
        return bool(self._since.max() > OVERLOAD_TIME)
