# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The live table of the demos, for a terminal of any size that is large enough."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
import math

from rich import box
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text
from urdf_reader import JointRange

from demo_runner import compose, DemoStatus

from .figures import AxisFigures, BusFigures, DriveFigures, ENABLED, Figures
from .report import bus_line, progress_line

NARROWEST = 80
"""Columns of a terminal below which there is no table."""
GAUGE_FROM = 102
"""Columns from which there is room for the gauges."""
WORDS_FROM = 118
"""Columns from which modes are written out."""
GAUGE_WIDTH = 21
"""Characters of a gauge."""
LINES_AROUND = 7
"""Title, head, its rule, a blank line, two lines of the bus, and one that is left free: a full
terminal would scroll at each refresh."""

STATE_STYLES = {
    ENABLED: 'green',
    'Fault': 'bold red',
    'Fault reaction active': 'bold red',
    'Quick stop active': 'yellow',
}
"""Colours of CiA 402 states; others are dim."""

SHORT = {
    'PRE_OPERATIONAL': 'PRE-OP',
    'BOOT_UP': 'BOOT-UP',
    'Profile position': 'PP',
    'Velocity': 'VL',
    'Profile velocity': 'PV',
    'Profile torque': 'TQ',
    'Homing': 'HM',
    'Interpolated position': 'IP',
    'Cyclic position': 'CSP',
    'Cyclic velocity': 'CSV',
    'Cyclic torque': 'CST',
    'No mode': '-',
}
"""How CiA 301 and CiA 402-2 abbreviate NMT states and modes."""


@dataclass(frozen=True, slots=True)
class ArmView:
    """How the figures of an arm look.

    Attributes:
        title: Robot and bus.
        limits: The joints, in the order of the rows.
        label: What the demo's own line begins with; without one there is none.
    """

    title: str
    limits: Mapping[str, JointRange]
    label: str = ''

    def fits(self, width: int, height: int) -> bool:
        """Say whether a terminal has room for the table.

        Args:
            width: Its columns.
            height: Its lines.
        """
        return width >= NARROWEST and height >= self._lines

    def progress(self, figures: Figures) -> str:
        """Say in a line how it goes.

        Args:
            figures: The latest.
        """
        if self.label:
            return f'{figures.line}; {bus_line(figures.bus)}'
        return progress_line(figures, self.limits)

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
        body: list[RenderableType] = [self.drives(figures, width), Text(''), bus_text(figures.bus)]
        if self.label:
            line = Text.assemble((f'{self.label:<7}', 'bold'), figures.line)
            line.truncate(width)
            body.append(line)
        room = height - self._lines
        return compose(self.title, status, body, (min(width, WORDS_FROM), width), room)

    @property
    def _lines(self) -> int:
        """Lines that it needs."""
        return len(self.limits) + LINES_AROUND + bool(self.label)

    def drives(self, figures: Figures, width: int) -> Table:
        """Draw the table of the drives.

        Args:
            figures: The latest.
            width: Columns of the terminal.
        """
        in_words = width >= WORDS_FROM
        table = Table(box=box.HORIZONTALS, show_edge=False, padding=0, header_style='bold')
        left = [('joint', 12), ('NMT', 11), ('CiA 402 state', 21), ('mode', 21 if in_words else 4)]
        right = [('position', 8), ('velocity', 8), ('error', 8)]
        for name, least in left:
            table.add_column(name, no_wrap=True, min_width=least)
        for name, least in right:
            table.add_column(name, no_wrap=True, min_width=least, justify='right')
        if width >= GAUGE_FROM:
            table.add_column(' between its limits', no_wrap=True, min_width=GAUGE_WIDTH + 1)
        for name, limits in self.limits.items():
            drive = figures.drives.get(name, DriveFigures())
            cells = _cells(name, drive, figures.axes.get(name), in_words=in_words)
            table.add_row(*cells, *([_gauge(drive, limits)] if width >= GAUGE_FROM else []))
        return table


def _cells(
    name: str, drive: DriveFigures, axis: AxisFigures | None, *, in_words: bool
) -> list[Text]:
    waving = axis is not None and axis.active
    mode = drive.mode if in_words else SHORT.get(drive.mode, drive.mode)
    return [
        Text(name, style='bold' if waving else ''),
        Text(SHORT.get(drive.nmt, drive.nmt), style='green' if drive.online else 'red'),
        Text(drive.state, style=STATE_STYLES.get(drive.state, 'dim')),
        Text(mode, style='' if waving else 'yellow'),
        Text(_signed(drive.position)),
        Text(_signed(drive.velocity)),
        Text(_signed(drive.following_error)),
    ]


def _signed(value: float) -> str:
    return f'{value:+.3f}' if math.isfinite(value) else '-'


def _gauge(drive: DriveFigures, limits: JointRange) -> Text:
    """Show where a joint is between its limits; outside of them the mark is red, at the end."""
    span = limits.upper - limits.lower
    if not math.isfinite(span) or not math.isfinite(drive.position):
        return Text('')
    share = (drive.position - limits.lower) / span
    place = round(min(max(share, 0.0), 1.0) * (GAUGE_WIDTH - 1))
    style = 'bold cyan' if 0.0 <= share <= 1.0 else 'bold red'
    before, after = '─' * place, '─' * (GAUGE_WIDTH - 1 - place)
    return Text.assemble(' ', (before, 'dim'), ('●', style), (after, 'dim'))


def bus_text(bus: BusFigures) -> Text:
    """Write two lines of bus and cycle.

    Args:
        bus: Their figures.
    """
    if not math.isfinite(bus.frames_per_second):
        return Text('bus    waiting for the master\n', style='dim')
    return Text.assemble(
        ('bus    ', 'bold'),
        f'{bus.frames_per_second:.0f} frames/s   load {bus.load:.0f} %   ',
        (f'{bus.lost} lost', 'bold red' if bus.lost else ''),
        f'   {bus.missed_pdos} PDOs missed\n',
        ('cycle  ', 'bold'),
        f'jitter p50 {1000 * bus.jitter_p50:.2f} ms   p99 {1000 * bus.jitter_p99:.2f} ms',
    )
