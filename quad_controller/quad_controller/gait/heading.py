# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Keeps the course: the robot turns as far as it was commanded to, and no further.

A gait drifts to a side and turns a few per cent too fast. The heading that the commands add up to
is compared with the measured one, and the turning is corrected in proportion.
"""

from __future__ import annotations

import math

from .velocity import Velocity

MAX_ERROR = 0.3  # [rad] a robot that was turned by hand does not turn back further
MAX_CORRECTION = 0.4  # [rad/s]


class HeadingHold:
    """Corrects the turning of a robot that walks."""

    def __init__(self, gain: float) -> None:
        """Start without a course.

        Args:
            gain: Correction per error in [1/s]; 0 switches it off.
        """
        self._gain = gain
        self._course: float | None = None

    def step(self, velocity: Velocity, heading: float | None, dt: float) -> Velocity:
        """Return the velocity to walk with.

        Args:
            velocity: The one that is wanted; at rest the course is forgotten.
            heading: Measured yaw in [rad], None when it is not known.
        """
        if heading is None or velocity.at_rest or self._gain == 0.0:
            self._course = None
            return velocity
        course = heading if self._course is None else self._course + velocity.yaw * dt
        error = math.remainder(course - heading, math.tau)
        error = min(max(error, -MAX_ERROR), MAX_ERROR)
        self._course = heading + error
        correction = min(max(self._gain * error, -MAX_CORRECTION), MAX_CORRECTION)
        return Velocity(velocity.x, velocity.y, velocity.yaw + correction)
