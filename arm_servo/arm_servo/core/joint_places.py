# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Where all joints of a robot are, and which of them move, from one look to the next."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, field
import math

PLACE_TOLERANCE = 1e-3
"""How far a joint that stands still may seem to move in [rad] or [m]: noise of its sensor."""


@dataclass(frozen=True, slots=True)
class JointPlaces:
    """One look at the joints of a robot."""

    # where they are in [rad] or [m], by joint
    places: Mapping[str, float] = field(default_factory=dict)
    moving: Collection[str] = frozenset()  # those that move

    def next(self, places: Mapping[str, float], commanded: Collection[str]) -> JointPlaces:
        """Return the next look; a joint that was not there before counts as one that moves."""
        moved = {
            joint
            for joint, place in places.items()
            if not abs(place - self.places.get(joint, math.nan)) <= PLACE_TOLERANCE
        }
        return JointPlaces(places, moved.union(commanded))
