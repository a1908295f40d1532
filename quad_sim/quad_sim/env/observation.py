# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What an environment lets a policy see: named parts in a row."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float32]


class Observation(Enum):
    """Parts of an observation in their order: what it is, and how many numbers (0: a joint)."""

    ANGULAR_VELOCITY = ('of base_link in its own frame in [rad/s]', 3)
    DOWN = ('direction of gravity in base_link', 3)
    COMMAND = ('velocity ahead and to the left in [m/s], turning in [rad/s]', 3)
    POSITIONS = ('of the joints, from those of a robot that stands, in [rad]', 0)
    VELOCITIES = ('of the joints in [rad/s]', 0)
    ACTION = ('of the step before in [rad]', 0)

    def width(self, joints: int) -> int:
        """Return how many numbers it has."""
        return self.value[1] or joints


def row_of(seen: Mapping[Observation, ArrayLike]) -> Floats:
    """Return all parts of what is seen, one after the other."""
    return np.concatenate([np.asarray(seen[part], np.float32) for part in Observation])
