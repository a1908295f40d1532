# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The live table of the demo, for a terminal of any size that is large enough."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
import math

from rich import box
from rich.console import RenderableType
from rich.table import Table
from rich.text import Text

from demo_runner import compose, DemoStatus

from .figures import Figures
from .report import progress_line
from .segments import Velocity

NARROWEST = 80
"""Columns of a terminal below which there is no table."""
BODY_LINES = 17
"""Title, speeds (5), blank, legs (6), blank, body and loop (2), and one that is left free."""
TILT_WARNING = math.radians(10.0)
"""A tilt in [rad] that is shown in red."""
PARTS = ('hip', 'thigh', 'calf')
"""Joints of a leg, from the body outward."""


@dataclass(frozen=True, slots=True)
class QuadView:
    """How the figures of a quadruped look.

    Attributes:
        title: What runs, and where.
        legs: Names of its legs, in the order of the rows.
    """

    title: str
    legs: Sequence[str]

    def fits(self, width: int, height: int) -> bool:
        """Return whether a terminal has room for the table.

        Args:
            width: Its columns.
            height: Its lines.
        """
        return width >= NARROWEST and height >= BODY_LINES

    def progress(self, figures: Figures) -> str:
        """Say in a line how it goes.

        Args:
            figures: The latest.
        """
        return progress_line(figures)

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
        body: list[RenderableType] = [
            _speeds(figures),
            Text(''),
            self._legs(figures),
            Text(''),
            _body_line(figures),
            _loop_line(figures),
        ]
        widths = (min(width, NARROWEST), width)
        return compose(self.title, status, body, widths, height - BODY_LINES)

    def _legs(self, figures: Figures) -> Table:
        table = _table(('leg', 9), *((f'{part} target/is', 20) for part in PARTS))
        for leg in self.legs:
            joints = [f'{leg}_{part}_joint' for part in PARTS]
            pairs = [_pair(figures.targets, figures.positions, joint) for joint in joints]
            table.add_row(Text(leg, style='bold'), *pairs)
        return table


def _table(*columns: tuple[str, int]) -> Table:
    table = Table(box=box.HORIZONTALS, show_edge=False, padding=0, header_style='bold')
    for index, (name, width) in enumerate(columns):
        justify = 'right' if index else 'left'
        table.add_column(name, no_wrap=True, min_width=width, justify=justify)  # type: ignore[arg-type]
    return table


def _speeds(figures: Figures) -> Table:
    table = _table(('velocity', 16), ('commanded', 16), ('in physics', 16), ('by /odom', 16))
    rows = (('forward [m/s]', 'forward'), ('left [m/s]', 'left'), ('turn [rad/s]', 'turn'))
    for title, name in rows:
        columns = (figures.commanded, figures.measured, figures.odometry)
        table.add_row(Text(title, style='bold'), *(_component(each, name) for each in columns))
    return table


def _component(velocity: Velocity | None, name: str) -> Text:
    return Text(_signed(math.nan if velocity is None else getattr(velocity, name)))


def _pair(targets: Mapping[str, float], positions: Mapping[str, float], joint: str) -> Text:
    target, position = (each.get(joint, math.nan) for each in (targets, positions))
    return Text(f'{_signed(target)} {_signed(position)}')


def _signed(value: float) -> str:
    # adding 0.0 turns a rounded -0.0 into 0.0
    return f'{round(value, 3) + 0.0:+.3f}' if math.isfinite(value) else '-'


def _body_line(figures: Figures) -> Text:
    tilted = figures.tilt > TILT_WARNING
    return Text.assemble(
        ('body  ', 'bold'),
        f'height {figures.height:.3f} m   ',
        (f'tilt {math.degrees(figures.tilt):.1f}°', 'bold red' if tilted else ''),
        f' (at most {math.degrees(figures.tilt_max):.1f}°)   battery {figures.battery:.0f} %   ',
        (figures.fault or figures.state, 'bold red' if figures.fault else 'green'),
        no_wrap=True,
        overflow='ellipsis',
    )


def _loop_line(figures: Figures) -> Text:
    periods = figures.periods
    if not math.isfinite(periods.rate):
        return Text('loop  waiting for the controller', style='dim')
    return Text.assemble(
        ('loop  ', 'bold'),
        f'{periods.rate:.1f} Hz   jitter p50 {1000 * periods.jitter_p50:.2f} ms   '
        f'p99 {1000 * periods.jitter_p99:.2f} ms',
    )
