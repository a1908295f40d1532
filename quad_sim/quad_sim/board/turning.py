# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Turning on the spot by an angle, as register 0x3F requests."""

from __future__ import annotations

import math

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
