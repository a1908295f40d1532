# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where the joints of an arm are and how they move."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from .arrays import Array, frozen


@dataclass(frozen=True, slots=True, eq=False)
class RobotState:
    """State of motion of every joint."""

    position: Array  # positions in [rad]
    velocity: Array  # velocities in [rad/s]
    acceleration: Array  # accelerations in [rad/s2]

    @classmethod
    def at_rest(cls, position: Sequence[float] | Array) -> RobotState:
        """Return the state of standing still."""
        zero = np.zeros(len(position))
        return cls(frozen(position), frozen(zero), frozen(zero))

    @property
    def moving(self) -> bool:
        """Whether a joint moves, or is about to."""
        return bool(self.velocity.any() or self.acceleration.any())
