# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where a servo may be that the robot does not report: from anywhere, to where it was sent.

Protocol v1 reads 15 of 16 servos; the yaw of the arm, 54, is the one that is left out. The
first time that it is sent somewhere, it may turn by its whole range. So it is sent at the lowest
speed, until it must have arrived.
"""

from __future__ import annotations

import math

from ..protocol import Span

FULL_SPEED, MIN_SPEED = 255, 1
"""Ends of the register that says how fast a single servo turns (quad.md 1.2)."""

MIN_RATE = 527.0 / FULL_SPEED
"""What the lowest speed is worth [deg/s] where the highest is that of a servo without load.

No page of the vendor says the unit; 9.2 rad/s is what the servo's data sheet allows.
"""


class UnseenServo:
    """Keeps the ends of where a servo may be, which move to its target as slowly as it may."""

    def __init__(self, span: Span, now: float) -> None:
        """Begin with a servo that may be anywhere in its range [deg]."""
        self._low, self._high = span.low, span.high
        self._target = math.nan
        self._at = now

    def send(self, angle: float, now: float) -> None:
        """Send it somewhere [deg]."""
        self._advance(now)
        self._target = angle

    def arrived(self, now: float) -> bool:
        """Return whether it must be where it was sent."""
        self._advance(now)
        return self._low == self._target == self._high

    def _advance(self, now: float) -> None:
        way, self._at = MIN_RATE * (now - self._at), now
        if not math.isnan(self._target):
            self._low = _toward(self._target, self._low, way)
            self._high = _toward(self._target, self._high, way)


def _toward(target: float, place: float, way: float) -> float:
    return min(max(target, place - way), place + way)
