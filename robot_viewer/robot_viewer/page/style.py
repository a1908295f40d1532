# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Colors by their meaning, marks for the overlay's style sheet, pieces of HTML, sliders.

Red is for STOP and faults alone. Contrast with the text on a color is at least 4.5.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from html import escape
from typing import TypeAlias

from viser import GuiApi, GuiSliderHandle

Color: TypeAlias = tuple[int, int, int]
Share = Callable[[], float]
"""Returns the share of the greatest velocity that was chosen, above 0 to 1."""

NEUTRAL: Color = (233, 236, 239)
"""Of buttons that look, stop or choose."""
WANTED: Color = (24, 100, 171)
"""Of the action that is wanted next, which gives power or executes what was shown."""
CAUTION: Color = (255, 212, 59)
"""Of what moves the robot by itself, or takes the torque: it may sink."""
PRESENT: Color = (52, 58, 64)
"""Of the mode that the robot is in."""

Mark: TypeAlias = tuple[str, str]

GOOD: Mark = ('✓', '#237032')
WARNING: Mark = ('⚠', '#8a6100')
BAD: Mark = ('⛔', '#c92a2a')
UNKNOWN: Mark = ('?', '#495057')
PLAIN: Mark = ('·', '#495057')
"""What a line means: an icon and its color, as a color alone is not seen by everyone."""
LEVEL_MARKS = (GOOD, WARNING, BAD, UNKNOWN)
"""Of the levels of a status: good, warning, error and stale."""
THREE_COLUMNS = '<b class="rv-pad3"></b>'
"""Marks a panel whose buttons stand in three columns."""


def line(text: str, mark: Mark = PLAIN, *, strong: bool = False) -> str:
    """Return a line behind a mark."""
    icon, color = mark
    weight = 'bold' if strong else 'normal'
    return (
        f'<div style="font-weight:{weight};margin:0.2em 12px;overflow-wrap:anywhere">'
        f'<span style="color:{color}">{icon}</span> {escape(text)}</div>'
    )


def status_line(text: str, level: int) -> str:
    """Return a line with the icon of a level."""
    return line(text, LEVEL_MARKS[level], strong=level not in {0, 3})


def pad(buttons: Iterable[str], kind: str = 'rv-pad') -> str:
    """Return buttons that are held, in columns."""
    return f'<div class="{kind}">{"".join(buttons)}</div>'


def sentence(text: str) -> str:
    """Return a sentence of a panel."""
    return f'<div style="margin:0.3em 12px">{escape(text)}</div>'


def value_of(slider: GuiSliderHandle[float]) -> float:
    """Return the value of a slider, within its range."""
    return min(max(slider.value, slider.min), slider.max)


def add_speed(gui: GuiApi, percent: float = 30.0) -> Share:
    """Add the slider of a speed."""
    slider = gui.add_slider('Speed [%]', 5.0, 100.0, 5.0, percent)
    return lambda: value_of(slider) / 100.0
