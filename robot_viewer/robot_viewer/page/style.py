# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Pieces of the page: colors by their meaning, marks for the overlay's style sheet, HTML, the log.

Red is for STOP and faults alone. Contrast with the text on a color is at least 4.5.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from html import escape
import time
from typing import TypeAlias

from viser import GuiApi, GuiButtonHandle, GuiDropdownHandle, GuiSliderHandle

Color: TypeAlias = tuple[int, int, int]
Share = Callable[[], float]
"""Returns the share of the greatest velocity that was chosen, above 0 to 1."""

NEUTRAL: Color = (233, 236, 239)  # of buttons that look, stop or choose
WANTED: Color = (24, 100, 171)
"""Of the action that is wanted next, which gives power or executes what was shown."""
CAUTION: Color = (255, 212, 59)
"""Of what moves the robot by itself, or takes the torque: it may sink."""
PRESENT: Color = (52, 58, 64)  # of the mode that the robot is in

Mark: TypeAlias = tuple[str, str]

GOOD: Mark = ('✓', '#237032')
WARNING: Mark = ('⚠', '#8a6100')
BAD: Mark = ('⛔', '#c92a2a')
UNKNOWN: Mark = ('?', '#495057')
PLAIN: Mark = ('·', '#495057')
"""What a line means: an icon and its color, as a color alone is not seen by everyone."""
LEVEL_MARKS = (GOOD, WARNING, BAD, UNKNOWN)
"""Of the levels of a status: good, warning, error and stale."""
THREE_COLUMNS = '<b class="rv-pad3"></b>'  # marks a panel whose buttons stand in three columns


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


def add_button(
    gui: GuiApi, label: str, press: Callable[[], None], color: Color = NEUTRAL
) -> GuiButtonHandle:
    """Add a button that acts when it is pressed."""
    button = gui.add_button(label, color=color)
    button.on_click(lambda _: press())
    return button


def add_choice(
    gui: GuiApi, label: str, options: Iterable[str], chosen: Callable[[str], None]
) -> GuiDropdownHandle[str]:
    """Add a list; reported is what is chosen on a page, and not what is set here."""
    box = gui.add_dropdown(label, tuple(options))
    box.on_update(lambda e: None if e.client_id is None else chosen(e.target.value))
    return box


def value_of(slider: GuiSliderHandle[float]) -> float:
    """Return the value of a slider, within its range."""
    return min(max(slider.value, slider.min), slider.max)


def add_speed(gui: GuiApi, percent: float = 30.0) -> Share:
    """Add the slider of a speed."""
    slider = gui.add_slider('Speed [%]', 5.0, 100.0, 5.0, percent)
    return lambda: value_of(slider) / 100.0


DRIVE_ROWS = {
    'nmt_state': 'NMT',
    'state': 'CiA 402',
    'mode': 'mode',
    'statusword': 'statusword',
    'error_code': 'error',
    'emergency': 'EMCY',
    'emergencies': 'EMCYs before',
    'position': 'position',
    'setpoint': 'set-point',
    'following_error': 'following error',
    'temperature': 'temperature',
    'missed_pdos': 'missed PDOs',
}
"""Values of the diagnostics of a drive that are shown, and what they are called."""
BUS_ROWS = {'bus_load': 'bus load [%]', 'frames_lost': 'frames lost', 'jitter_p99': 'jitter [s]'}
"""The same of the bus."""
KEPT = 200  # number of entries that are kept


def drive_html(message: str, values: Mapping[str, str], bus: Mapping[str, str]) -> str:
    """Return the table of a drive; what is not reported, or empty, has no row."""
    shown = [(title, values.get(key, '')) for key, title in DRIVE_ROWS.items()]
    shown += [(title, bus.get(key, '')) for key, title in BUS_ROWS.items()]
    rows = ''.join(
        f'<tr><td style="vertical-align:top;padding-right:1em">{escape(title)}</td>'
        f'<td>{escape(text)}</td></tr>'
        for title, text in shown
        if text
    )
    return (
        f'<div style="margin:0.3em 1em"><b>{escape(message)}</b>'
        f'<table style="font-variant-numeric:tabular-nums">{rows}</table></div>'
    )


@dataclass(slots=True)
class _Entry:
    at: float
    who: str
    text: str
    mark: Mark
    count: int = 1


class Log:
    """The last entries; what is said again is counted. Thread-safe."""

    def __init__(self) -> None:
        """Begin with none."""
        self._entries: deque[_Entry] = deque(maxlen=KEPT)
        self._html, self._changed = '', False

    def add(self, at: float, who: str, text: str, mark: Mark) -> None:
        """Keep an entry."""
        last = self._entries[-1] if self._entries else None
        if last is not None and (last.who, last.text) == (who, text):
            last.at, last.count = at, last.count + 1
        else:
            self._entries.append(_Entry(at, who, text, mark))
        self._changed = True

    @property
    def html(self) -> str:
        """All of it, the last entry first."""
        if self._changed:
            self._changed = False  # first: another thread may add an entry meanwhile
            self._html = ''.join(map(_line, reversed(tuple(self._entries))))
        return self._html


def _line(entry: _Entry) -> str:
    clock = time.strftime('%H:%M:%S', time.localtime(entry.at))
    again = f' ({entry.count} times)' if entry.count > 1 else ''
    icon, color = entry.mark
    return (
        '<div style="margin:0 1em 0.4em;overflow-wrap:anywhere"><span style="color:'
        f'{color}">{icon}</span> {clock} <b>{escape(entry.who)}</b>{again}<br>'
        f'{escape(entry.text)}</div>'
    )
