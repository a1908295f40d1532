# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""How long a motion to a target takes, and what joints did in the last half minute.

Positions in [rad] or [m], times in [s].
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
import math

KEPT = 30.0
"""How long the past is kept in [s]."""
STEP = 0.1
"""Least time between two samples in [s]."""
SHORTEST = 0.3
"""Shortest motion in [s]."""
GREATEST_ACCELERATION = 2.0
"""Of a motion to a target in [rad/s^2] or [m/s^2]: descriptions name none."""
PEAK, PEAK_ACCELERATION = 15.0 / 8.0, 10.0 / math.sqrt(3.0)
"""Greatest velocity and acceleration of a quintic from rest to rest: as a multiple of its mean
velocity, and of its way through the square of its time."""


def motion_time(
    start: Mapping[str, float],
    target: Mapping[str, float],
    velocities: Mapping[str, float],
    share: float,
) -> float:
    """Return how long a smooth motion takes.

    Args:
        start: Where the joints are; one that is missing does not move.
        target: Where they are to be.
        velocities: Greatest velocity of each; 1 for one that is missing.
        share: Of the greatest velocity, above 0 to 1.
    """
    longest = SHORTEST
    for name, position in target.items():
        way = abs(position - start.get(name, position))
        greatest = velocities.get(name, 1.0) * share
        longest = max(
            longest,
            PEAK * way / greatest,
            math.sqrt(PEAK_ACCELERATION * way / (GREATEST_ACCELERATION * share)),
        )
    return longest


@dataclass(frozen=True, slots=True)
class Sample:
    """A joint at one time.

    Attributes:
        time: Steady time.
        target: Where it was to be.
        position: Where it was.
    """

    time: float
    target: float
    position: float


class History:
    """The samples of all joints in the last :data:`KEPT` seconds."""

    def __init__(self) -> None:
        """Begin with none."""
        self._samples: dict[str, deque[Sample]] = {}

    @property
    def joints(self) -> tuple[str, ...]:
        """The joints that have samples."""
        return tuple(self._samples)

    def add(
        self, targets: Mapping[str, float], positions: Mapping[str, float], now: float
    ) -> None:
        """Store joint positions; ones that come too soon after the last are ignored."""
        for name in (each for each in targets if each in positions):
            samples = self._samples.setdefault(name, deque())
            if samples and now - samples[-1].time < STEP:
                continue
            samples.append(Sample(now, targets[name], positions[name]))
            while samples[0].time < now - KEPT:
                samples.popleft()

    def of(self, joint: str) -> tuple[Sample, ...]:
        """Return the samples of a joint, the oldest first."""
        return tuple(self._samples.get(joint, ()))
