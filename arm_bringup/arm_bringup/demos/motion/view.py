# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The live table: the drives as in the first demo, and a line of the motion."""

from __future__ import annotations

from dataclasses import dataclass

from rich.console import RenderableType
from rich.text import Text

from demo_runner import compose, DemoStatus

from ..figures import Figures
from ..report import bus_line
from ..table import ArmView, bus_text, LINES_AROUND, WORDS_FROM
from .figures import MotionFigures


@dataclass(frozen=True, slots=True)
class MotionView:
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
        return f'{motion_line(figures)}; {bus_line(figures.bus)}'

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
        line = Text.assemble(('motion ', 'bold'), motion_line(figures))
        line.truncate(width)
        table = self.arm.drives(figures, width)
        body: list[RenderableType] = [table, Text(''), bus_text(figures.bus), line]
        room = height - 1 - len(self.arm.limits) - LINES_AROUND
        return compose(self.title, status, body, (min(width, WORDS_FROM), width), room)


def motion_line(figures: Figures) -> str:
    """Say what moves the arm.

    Args:
        figures: The latest.
    """
    if not isinstance(figures, MotionFigures):
        return ''
    return (
        f'tool {figures.tool_speed:.3f} m/s   override {100 * figures.override:.0f} %   '
        f'peak jerk {100 * figures.jerk:.0f} % of the limit   {figures.words}'
    )
