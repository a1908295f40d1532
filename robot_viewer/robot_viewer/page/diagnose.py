# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a drive reports, and what the page and the nodes of the robot said, as HTML."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
import time

from .style import Mark

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
KEPT = 200
"""Number of entries that are kept."""


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
    """The last entries; what is said again is counted. Thread-safe.

    Attributes:
        html: All of it, the last entry first.
    """

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
