# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The last thing that a target passes: limits, and a bound of the step from the one before.

A joint that is found outside of its limits is not pulled into them before something is requested:
its range reaches to where it is, and shrinks with it.
"""

from __future__ import annotations

from collections.abc import Sequence
import math

from quad_description import JointLimits, Targets

MAX_PERIODS = 1.5  # periods; a step that comes late may not be a leap


class StepLimiter:
    """Keeps targets within the joints' ranges, and steps within their speed.

    Attributes:
        limited: How many targets of single joints were too fast so far, and were cut.
    """

    def __init__(self, limits: Sequence[JointLimits], period: float, speed: float = 1.0) -> None:
        """Start at no target.

        Args:
            speed: Speed of a target per speed of its joint.
        """
        self._limits = tuple(limits)
        self._longest = MAX_PERIODS * period
        self._speed = speed
        self._last: Targets | None = None
        self.limited = 0

    @property
    def last(self) -> Targets | None:
        """What was let through last; None at the beginning."""
        return self._last

    def start(self, positions: Sequence[float]) -> Targets:
        """Begin where the joints are [rad], even if that is outside of their limits."""
        self._last = tuple(positions)
        return self._last

    def reset(self) -> None:
        """Forget what was let through: joints were moved by something else."""
        self._last = None

    def step(self, targets: Sequence[float], dt: float) -> Targets:
        """Return what may be sent instead of some targets.

        Args:
            targets: What is wanted; finite.
        """
        if self._last is None:
            return self.start(targets)
        dt = min(dt, self._longest) * self._speed
        sent = []
        for limits, before, wanted in zip(self._limits, self._last, targets, strict=True):
            most = limits.velocity * dt
            target = min(max(wanted, min(limits.lower, before)), max(limits.upper, before))
            if abs(target - before) > most:
                target = before + math.copysign(most, target - before)
                self.limited += 1
            sent.append(target)
        self._last = tuple(sent)
        return self._last
