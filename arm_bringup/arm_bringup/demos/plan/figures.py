# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo shows while it runs."""

from __future__ import annotations

from dataclasses import dataclass
import math

from ..figures import Figures


@dataclass(frozen=True, slots=True)
class PlanFigures(Figures):
    """Drives and bus, and what was planned and measured last.

    Attributes:
        words: What move_group was asked for, or answered.
        planning_time: Time of the last planning in [s].
        clearance: Distance to the nearest obstacle at the last joint states in [m].
        nearest: The two of them.
    """

    words: str = ''
    planning_time: float = math.nan
    clearance: float = math.nan
    nearest: tuple[str, str] = ('', '')

    @property
    def line(self) -> str:
        """What was planned, and how near the arm is to what."""
        parts = []
        if math.isfinite(self.planning_time):
            parts.append(f'planned in {1e3 * self.planning_time:.0f} ms')
        if math.isfinite(self.clearance):
            first, second = self.nearest
            parts.append(f'{1e3 * self.clearance:.0f} mm between {first} and {second}')
        return '   '.join([*parts, self.words])
