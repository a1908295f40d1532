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
    """State of motion of every joint.

    Attributes:
        position: Positions in [rad].
        velocity: Velocities in [rad/s].
        acceleration: Accelerations in [rad/s2].
    """

    position: Array
    velocity: Array
    acceleration: Array

    @classmethod
    def at_rest(cls, position: Sequence[float] | Array) -> RobotState:
        """Return the state of standing still.

        Args:
            position: Positions in [rad].
        """
        zero = np.zeros(len(position))
        return cls(frozen(position), frozen(zero), frozen(zero))

    @property
    def moving(self) -> bool:
        """Whether a joint moves, or is about to."""
        return bool(np.any(self.velocity) or np.any(self.acceleration))
