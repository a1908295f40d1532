# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo found out: of motions that were seen, and of what came to rest where."""

from __future__ import annotations

from dataclasses import dataclass, field
import math

import numpy as np

from arm_model import Array, Pose

from ..results import Results
from .observer import Watch

WORST_JOINT = 5e-3
"""Farthest that a joint may stand from its goal in [rad] or [m]."""
WORST_PLACE, WORST_TURN = 2e-3, 1e-2
"""Farthest that a tool or a part may be from its goal, in [m] and [rad]."""
WORST_GAP = 0.5
"""Farthest that a joint may move unseen in [rad] or [m]: a computer may be held up."""


@dataclass(slots=True)
class PlanResults(Results):
    """Filled while the demo runs.

    Attributes:
        planning_times: Of all plans in [s].
    """

    planning_times: list[float] = field(default_factory=list)

    def watched(self, name: str, watch: Watch) -> None:
        """Judge what was seen of a motion: contacts, and whether all of it was seen.

        Args:
            name: In which part.
            watch: What was seen.
        """
        for words in watch.contacts.values():
            self.problem(name, words)
        if watch.gap > WORST_GAP:
            self.problem(
                name, f'joint states were {watch.gap:.2f} apart: nobody saw what was between'
            )

    def arrived(self, name: str, off: float, most: float, unit: str) -> None:
        """Judge where something came to rest.

        Args:
            name: In which part.
            off: How far from its goal, in the unit.
            most: How far is good enough.
            unit: m or rad.
        """
        if not off <= most:
            self.problem(name, f'{1e3 * off:.1f} m{unit} from its goal')

    def planned(self) -> str:
        """Return how long planning took."""
        if not self.planning_times:
            return 'nothing was planned'
        times = 1e3 * np.array(self.planning_times)
        return f'{len(times)} plans, p50 {np.median(times):.0f} ms, greatest {times.max():.0f} ms'


def clearance(watch: Watch) -> str:
    """Say how near something came to an obstacle.

    Args:
        watch: What was seen.
    """
    if not math.isfinite(watch.clearance):
        return 'no obstacle near'
    return f'nearest {1e3 * watch.clearance:.0f} mm, {" to ".join(watch.nearest)}'


def apart(one: Pose, other: Pose) -> tuple[float, float]:
    """Return how far two poses are apart in [m] and [rad].

    Args:
        one: A pose.
        other: Another, in the same frame.
    """
    turn: Array = one.rotation.T @ other.rotation
    cos = min(max((float(np.trace(turn)) - 1.0) / 2.0, -1.0), 1.0)
    return float(np.linalg.norm(one.position - other.position)), math.acos(cos)
