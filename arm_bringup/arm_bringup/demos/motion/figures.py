# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the demo shows while it runs."""

from __future__ import annotations

from dataclasses import dataclass

from ..figures import Figures


@dataclass(frozen=True, slots=True)
class MotionFigures(Figures):
    """Drives and bus, and what moves the arm.

    Attributes:
        words: What the servo says.
        tool_speed: Speed of the commanded tool in [m/s].
        override: Speed override, 0 to 1.
        jerk: Greatest jerk so far, as a share of the limit.
    """

    words: str = ''
    tool_speed: float = 0.0
    override: float = 1.0
    jerk: float = 0.0

    @property
    def line(self) -> str:
        """What moves the arm."""
        return (
            f'tool {self.tool_speed:.3f} m/s   override {100 * self.override:.0f} %   '
            f'peak jerk {100 * self.jerk:.0f} % of the limit   {self.words}'
        )
