# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Elements of the page: colors by meaning, marks for the overlay's style sheet, HTML, the log.

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
"""Returns the selected fraction of maximum velocity, above 0 to 1."""

NEUTRAL: Color = (233, 236, 239)  # of buttons that view, stop or select
WANTED: Color = (24, 100, 171)
"""Color of the suggested next action, which enables power or executes a plan."""
CAUTION: Color = (255, 212, 59)
"""Color of actions that move the robot by themselves, or remove torque: it may sink."""
PRESENT: Color = (52, 58, 64)  # of the robot's present mode

Mark: TypeAlias = tuple[str, str]

GOOD: Mark = ('✓', '#237032')
WARNING: Mark = ('⚠', '#8a6100')
BAD: Mark = ('✖', '#c92a2a')
UNKNOWN: Mark = ('?', '#495057')
PLAIN: Mark = ('·', '#495057')
"""Meaning of a line: icon and color, since not everyone can see a color alone."""
LEVEL_MARKS = (GOOD, WARNING, BAD, UNKNOWN)
"""Marks of the status levels: good, warning, error and stale."""
THREE_COLUMNS = '<b class="rv-pad3"></b>'  # marks a panel with three columns of buttons


def line(text: str, mark: Mark = PLAIN, *, strong: bool = False) -> str:
    """Return the HTML of a line with a mark."""
    icon, color = mark
    weight = 'bold' if strong else 'normal'
    return (
        f'<div style="font-weight:{weight};margin:0.2em 12px;overflow-wrap:anywhere">'
        f'<span style="color:{color}">{icon}</span> {escape(text)}</div>'
    )


def status_line(text: str, level: int) -> str:
    """Return the HTML of a line with the icon of a status level."""
    return line(text, LEVEL_MARKS[level], strong=level not in {0, 3})


def pad(buttons: Iterable[str], kind: str = 'rv-pad') -> str:
    """Return the HTML of hold buttons in columns."""
    return f'<div class="{kind}">{"".join(buttons)}</div>'


def sentence(text: str) -> str:
    """Return the HTML of a sentence in a panel."""
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
    """Add a dropdown; ``chosen`` is called for selections on a page, not for values set here."""
    box = gui.add_dropdown(label, tuple(options))
    box.on_update(lambda e: None if e.client_id is None else chosen(e.target.value))
    return box


def value_of(slider: GuiSliderHandle[float]) -> float:
    """Return the value of a slider, within its range."""
    return min(max(slider.value, slider.min), slider.max)


def add_speed(gui: GuiApi, percent: float = 30.0) -> Share:
    """Add a speed slider; return a function that reads it."""
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
"""Drive diagnostics that are shown, with their labels."""
BUS_ROWS = {'bus_load': 'bus load [%]', 'frames_lost': 'frames lost', 'jitter_p99': 'jitter [s]'}
"""Bus diagnostics that are shown, with their labels."""
KEPT = 200  # maximum number of log entries


def drive_html(message: str, values: Mapping[str, str], bus: Mapping[str, str]) -> str:
    """Return the HTML table of a drive; missing or empty values have no row."""
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
    """The latest log entries; repetitions are counted. Thread-safe."""

    def __init__(self) -> None:
        self._entries: deque[_Entry] = deque(maxlen=KEPT)
        self._html, self._changed = '', False

    def add(self, at: float, who: str, text: str, mark: Mark) -> None:
        """Store an entry."""
        last = self._entries[-1] if self._entries else None
        if last is not None and (last.who, last.text) == (who, text):
            last.at, last.count = at, last.count + 1
        else:
            self._entries.append(_Entry(at, who, text, mark))
        self._changed = True

    @property
    def html(self) -> str:
        """HTML of all entries, the latest first."""
        if self._changed:
            self._changed = False  # before reading: another thread may add an entry
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
