# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether motions of a search are free of contact, and heed what holds on the path."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
import math

import numpy as np

from arm_model import Array
from arm_trajectory import Path

from ..constraints import ConstraintCheck
from ..validity import ValidityCheck, Violation

STRIDE = 0.15  # length of a motion between two states that heed constraints in [rad]
MIN_PROGRESS = 0.01  # by how much such a motion comes nearer to its target at least in [rad]
LOOK = 0.03  # turn of all joints together between two looks at constraints in [rad]


class MotionCheck:
    """Checks of one search: contact, and path constraints; belongs to one thread."""

    def __init__(
        self,
        check: ValidityCheck,
        ends: Sequence[Array],
        constraints: ConstraintCheck | None = None,
    ) -> None:
        """Prepare.

        Args:
            ends: Starts and goals: on the way a pair may be as near as it is there.
            constraints: What holds everywhere; None for nothing.
        """
        self.constraints, self._check = constraints, check
        self.required, self.compiled = check.required(*ends), check.compiled

    def admits(self, goal: Array) -> bool:
        """Whether a state that was no end when the search began may be one.

        Args:
            goal: Joint positions in [rad] (n), valid.
        """
        return bool((self._check.required(goal) >= self.required).all())

    def clear(self, begin: Array, end: Array) -> bool:
        """Whether a straight motion is free everywhere.

        Args:
            begin: Joint positions in [rad] (n), known to be free.
        """
        if self.constraints is not None and not _heeded(self.constraints, begin, end - begin):
            return False
        return self._check.near(begin, end, self.required) is None

    def waypoints(self, places: Array) -> Violation | None:
        """Return what is wrong with the straight lines between places; None for nothing.

        Args:
            places: Joint positions in [rad] (m, n).
        """
        violation = self._check.waypoints(places)
        if violation is None and self.constraints is not None:
            return self.constraints.lines(places)
        return violation

    def path(self, path: Path) -> Violation | None:
        """Return what is wrong with a path; None for nothing."""
        violation = self._check.path(path)
        if violation is None and self.constraints is not None:
            return self.constraints.path(path)
        return violation

    def towards(self, begin: Array, target: Array) -> Array | None:
        """Return the next state on a motion that heeds the constraints; None where it ends.

        Args:
            begin: Joint positions in [rad] (n), which heed the constraints.
            target: Joint positions in [rad] (n) that are nearer with each state.
        """
        way = target - begin
        length = float(np.linalg.norm(way))
        wanted = target if length <= STRIDE else begin + way * (STRIDE / length)
        end = wanted if self.constraints is None else self.constraints.projected(wanted)
        if end is None or float(np.linalg.norm(end - begin)) > 2.0 * STRIDE:
            return None
        left = float(np.linalg.norm(target - end))
        return end if left < length - MIN_PROGRESS or left == 0.0 else None


def _heeded(constraints: ConstraintCheck, begin: Array, way: Array) -> bool:
    """Whether constraints hold on a straight motion, as far as a quick look shows."""
    shares = _coarse_first(math.ceil(float(np.abs(way).sum()) / LOOK) + 1)
    return all(map(constraints.heeds, begin + shares[:, None] * way))


@lru_cache(maxsize=1024)
def _coarse_first(count: int) -> Array:
    """Return the shares 1/count .. 1, of which early ones are far apart."""
    bits = max(count - 1, 1).bit_length()
    numbers = np.arange(1 << bits)
    reversed_bits = np.zeros_like(numbers)
    for bit in range(bits):
        reversed_bits |= ((numbers >> bit) & 1) << (bits - 1 - bit)
    order = reversed_bits[reversed_bits < count]
    shares: Array = (count - order) / count
    return shares
