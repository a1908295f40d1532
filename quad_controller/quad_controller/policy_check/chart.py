# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A line chart as SVG text, small enough to be no reason for a plotting library."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
import math

WIDTH, HEIGHT = 340, 230
LEFT, RIGHT, TOP, BOTTOM = 46, 18, 28, 40
COLOURS = ('#1663c7', '#d9680b', '#8a8f98')
TICKS = 4

Point = tuple[float, float]


@dataclass(frozen=True, slots=True)
class Line:
    """A line of a chart.

    Attributes:
        name: What it is.
        points: Its points, x first; those that are not finite are left out.
        dashed: It is drawn thin, without points, to compare with.
    """

    name: str
    points: Sequence[Point]
    dashed: bool = False


def line_chart(title: str, x_title: str, y_title: str, lines: Sequence[Line]) -> str:
    """Return a chart of lines.

    Args:
        title: What a person reads above it.
        x_title: Below the axis, with its unit.
        y_title: Of the other one.
        lines: In the order of their colours.
    """
    points = [point for line in lines for point in line.points if all(map(math.isfinite, point))]
    if not points:
        return ''
    (x_low, x_high), (y_low, y_high) = (
        _span([point[axis] for point in points]) for axis in (0, 1)
    )

    def place(point: Point) -> Point:
        x = LEFT + (point[0] - x_low) / (x_high - x_low) * (WIDTH - LEFT - RIGHT)
        return x, HEIGHT - BOTTOM - (point[1] - y_low) / (y_high - y_low) * (HEIGHT - TOP - BOTTOM)

    parts = [
        f'<svg viewBox="0 0 {WIDTH} {HEIGHT}" role="img" aria-label="{escape(title)}">',
        f'<text class="title" x="{LEFT}" y="16">{escape(title)}</text>',
    ]
    for step in range(TICKS + 1):
        x, y = (low + (high - low) * step / TICKS
                for low, high in ((x_low, x_high), (y_low, y_high)))  # fmt: skip
        at_x, at_y = place((x, y))
        parts += [
            f'<path class="grid" d="M{LEFT} {at_y:.1f}H{WIDTH - RIGHT}"/>',
            f'<text x="{LEFT - 5}" y="{at_y + 3.5:.1f}" text-anchor="end">{y:.3g}</text>',
            f'<text x="{at_x:.1f}" y="{HEIGHT - BOTTOM + 14}" text-anchor="middle">{x:.3g}</text>',
        ]
    for line, colour in zip(lines, COLOURS, strict=False):
        parts += _drawn(
            line, colour, [place(p) for p in line.points if all(map(math.isfinite, p))]
        )
    parts += [
        f'<text x="{WIDTH - RIGHT}" y="{HEIGHT - 8}" text-anchor="end">{escape(x_title)}</text>',
        f'<text x="{LEFT}" y="{HEIGHT - 8}">{escape(y_title)}</text>',
        '</svg>',
    ]
    return '\n'.join(parts)


def _drawn(line: Line, colour: str, places: Sequence[Point]) -> list[str]:
    path = ' '.join(f'{x:.1f},{y:.1f}' for x, y in places)
    style = 'stroke-width="1" stroke-dasharray="4 3"' if line.dashed else 'stroke-width="2"'
    name = f'<title>{escape(line.name)}</title>'
    drawn = [f'<polyline fill="none" stroke="{colour}" {style} points="{path}">{name}</polyline>']
    if not line.dashed:
        drawn += [f'<circle cx="{x:.1f}" cy="{y:.1f}" r="3" fill="{colour}"/>' for x, y in places]
    return drawn


def _span(values: Sequence[float]) -> Point:
    """Return the ends of an axis that has some values and zero."""
    low, high = min(0.0, *values), max(0.0, *values)
    return (low, high) if high - low > 1e-9 else (low, low + 1.0)
