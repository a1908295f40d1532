# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the page and the nodes of the robot said, the last first."""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass
from html import escape
import time

from .style import Mark

KEPT = 200
"""Number of entries that are kept."""


@dataclass(slots=True)
class _Entry:
    at: float
    who: str
    text: str
    mark: Mark
    count: int = 1


class Log:
    """The last entries; what is said again is counted.

    Attributes:
        html: All of it, the last entry first.
    """

    def __init__(self) -> None:
        """Begin with none."""
        self._entries: deque[_Entry] = deque(maxlen=KEPT)
        self._html: str | None = ''

    def add(self, at: float, who: str, text: str, mark: Mark) -> None:
        """Keep an entry."""
        self._html = None
        last = self._entries[-1] if self._entries else None
        if last is not None and (last.who, last.text) == (who, text):
            last.at, last.count = at, last.count + 1
        else:
            self._entries.append(_Entry(at, who, text, mark))

    @property
    def html(self) -> str:
        """All of it, the last entry first."""
        if self._html is None:
            self._html = ''.join(map(_line, reversed(self._entries)))
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
