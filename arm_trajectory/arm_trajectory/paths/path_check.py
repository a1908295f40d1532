# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Whether links of the arm meet each other or an object on a way, found before anything moves.

A way is looked at in steps in which no link moves by more than :data:`MAX_STEP` against another,
so a contact that is passed over is shallower than that. Distances are measured only where the
distance rate bounds of the planning scene do not prove that a pair is clear.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
import math

import numpy as np

from arm_model import Array, Clearances, PlanningScene

MAX_STEP = 0.005  # greatest motion of a link against another from one look to the next in [m]
COARSE_PERIOD = 0.01  # time between the places from which the steps are laid out in [s]
MAX_SAMPLES = 50_000  # looks at one way at most: beyond 250 m of motion they are farther apart
MAX_BATCH = 64  # looks that are proven clear at once at most

CONTACT_TOLERANCE = 1e-4
"""Overlap that is let pass in [m], for rounding; in contact already, how much more of it."""


@dataclass(frozen=True, slots=True)
class PathContact:
    """Two links, or a link and an object, that meet on a way."""

    links: tuple[str, str]  # their names
    time: float  # when they meet in [s]


class PathCheck:
    """Looks for contact of links on ways; for one thread."""

    def __init__(self, scene: PlanningScene) -> None:
        """Prepare.

        Args:
            scene: What may collide: ``model.scene`` is the arm alone.
        """
        self._clearances = Clearances(scene)

    def contact(
        self, positions_at: Callable[[Array], Array], duration: float
    ) -> PathContact | None:
        """Return the first contact on a way.

        An arm that begins in contact may part, and may not come nearer.

        Args:
            positions_at: Joint positions in [rad] (k, n) at times in [s] (k).
        """
        if not self._clearances.pairs:
            return None
        times = self._looks(positions_at, duration)
        rows = positions_at(times)
        floor = np.full(len(self._clearances.pairs), -np.inf)
        place, ahead = 0, 1
        while place < len(rows):
            passed = self._clearances.provably_clear(rows[place : place + ahead], 0.0)
            if passed:
                floor.fill(-CONTACT_TOLERANCE)
                place, ahead = place + passed, min(2 * ahead, MAX_BATCH)
                continue
            distances = self._clearances.least(rows[place], 0.0)
            deeper = distances < floor
            if deeper.any():
                links = self._clearances.pairs[int(deeper.argmax())]
                return PathContact(links, float(times[place]))
            floor = np.maximum(floor, np.minimum(distances, 0.0) - CONTACT_TOLERANCE)
            place, ahead = place + 1, 1
        return None

    def _looks(self, positions_at: Callable[[Array], Array], duration: float) -> Array:
        """Return the times to look at: dense where the arm moves fast."""
        coarse = np.linspace(0.0, duration, math.ceil(duration / COARSE_PERIOD) + 2)
        turns = np.abs(np.diff(positions_at(coarse), axis=0))
        motion = (turns @ self._clearances.distance_rate_bounds.T).max(axis=1)
        along = np.concatenate(((0.0,), np.cumsum(motion)))
        count = min(math.ceil(along[-1] / MAX_STEP), MAX_SAMPLES)
        times: Array = np.interp(np.linspace(0.0, along[-1], count + 1), along, coarse)
        return times
