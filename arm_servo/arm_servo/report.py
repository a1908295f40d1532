# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What limits a motion, in numbers and in words."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Cause(Enum):
    """Why a motion is slower than asked."""

    JOINT_POSITION = 'joint limit'
    JOINT_VELOCITY = 'joint speed'
    JOINT_ACCELERATION = 'joint acceleration'
    COLLISION = 'collision'
    SINGULARITY = 'singularity'
    HOLD = 'path'
    SOLVER = 'solver'


@dataclass(frozen=True, slots=True)
class Limiter:
    """One thing that limits a motion."""

    cause: Cause  # its kind
    name: str  # what it is: a joint, two links, an axis of the tool
    # way left in [rad] or [m], speed asked in [rad/s], or measure of the singularity
    amount: float
    factor: float  # what it leaves of the asked speed, 0 to 1

    def __str__(self) -> str:
        """Describe it in a few words."""
        if self.cause is Cause.COLLISION:
            return f'collision: {self.name} at {1e3 * self.amount:.0f} mm, {self.factor:.2f}x'
        if self.cause is Cause.JOINT_POSITION:
            left = round(self.amount, 3) + 0.0  # never -0.000
            return f'joint limit: {self.name}, {left:.3f} left, {self.factor:.2f}x'
        if self.cause is Cause.JOINT_VELOCITY:
            return f'joint speed: {self.name} would need {self.amount:.2f}, {self.factor:.2f}x'
        return f'{self.cause.value}: {self.name}, {self.factor:.2f}x'


@dataclass(frozen=True, slots=True)
class MotionReport:
    """How a command is carried out."""

    factor: float = 1.0  # achieved share of the asked speed; 1 when nothing limits it
    limiters: tuple[Limiter, ...] = ()  # what limits it, the strongest first

    def __post_init__(self) -> None:
        """Sort the limiters, so that the first is the one that matters."""
        if len(self.limiters) > 1:
            strongest = tuple(sorted(self.limiters, key=lambda limiter: limiter.factor))
            object.__setattr__(self, 'limiters', strongest)

    def with_limiter(self, limiter: Limiter) -> MotionReport:
        """Return the report with one limiter more."""
        return MotionReport(min(self.factor, limiter.factor), (limiter, *self.limiters))

    def __str__(self) -> str:
        """Describe it in one line."""
        if not self.limiters:
            return 'free'
        return '; '.join(str(limiter) for limiter in self.limiters)
