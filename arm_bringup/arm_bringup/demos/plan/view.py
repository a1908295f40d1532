# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The live table: the drives as in the first demo, and a line of planning and clearance."""

from __future__ import annotations

from dataclasses import dataclass
import math

from rich.console import RenderableType
from rich.text import Text

from demo_runner import compose, DemoStatus

from ..figures import Figures
from ..report import bus_line
from ..table import ArmView, bus_text, LINES_AROUND, WORDS_FROM
from .figures import PlanFigures


@dataclass(frozen=True, slots=True)
class PlanView:
    """How the figures look.

    Attributes:
        arm: How the drives look.
    """

    arm: ArmView

    @property
    def title(self) -> str:
        """What runs, and where."""
        return self.arm.title

    def fits(self, width: int, height: int) -> bool:
        """Say whether a terminal has room for the table.

        Args:
            width: Its columns.
            height: Its lines.
        """
        return self.arm.fits(width, height - 1)

    def progress(self, figures: Figures) -> str:
        """Say in a line how it goes.

        Args:
            figures: The latest.
        """
        return f'{plan_line(figures)}; {bus_line(figures.bus)}'

    def render(
        self, figures: Figures, status: DemoStatus, width: int, height: int
    ) -> RenderableType:
        """Draw everything; commands and messages that there is no room for are left out.

        Args:
            figures: The latest.
            status: What else is shown.
            width: Columns of the terminal.
            height: Lines of the terminal.
        """
        line = Text.assemble(('plan   ', 'bold'), plan_line(figures))
        line.truncate(width)
        table = self.arm.drives(figures, width)
        body: list[RenderableType] = [table, Text(''), bus_text(figures.bus), line]
        room = height - 1 - len(self.arm.limits) - LINES_AROUND
        return compose(self.title, status, body, (min(width, WORDS_FROM), width), room)


def plan_line(figures: Figures) -> str:
    """Say what was planned, and how near the arm is to what.

    Args:
        figures: The latest.
    """
    if not isinstance(figures, PlanFigures):
        return ''
    parts = []
    if math.isfinite(figures.planning_time):
        parts.append(f'planned in {1e3 * figures.planning_time:.0f} ms')
    if math.isfinite(figures.clearance):
        first, second = figures.nearest
        parts.append(f'{1e3 * figures.clearance:.0f} mm between {first} and {second}')
    return '   '.join([*parts, figures.words])
