# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One line at the bottom that is written again and again, and messages above it."""

from __future__ import annotations

from collections.abc import Iterable
from enum import Enum
import re
from typing import Protocol
import unicodedata

_CONTROL = re.compile('\x1b\\[[0-9;]*m')
RESET, CLEAR_LINE = '\x1b[0m', '\r\x1b[K'


class Style(Enum):
    """How a part looks, as a control sequence of ECMA-48 (SGR)."""

    PLAIN = ''
    BOLD = '\x1b[1m'
    DIM = '\x1b[2m'
    GREEN = '\x1b[32m'
    YELLOW = '\x1b[33m'
    RED = '\x1b[1;31m'


StatusPart = tuple[str, Style]


def status_text(parts: Iterable[StatusPart], *, colour: bool) -> str:
    """Join the parts of a status line, what matters most first: a narrow window cuts the rest."""
    return ' | '.join(
        f'{style.value}{text}{RESET}' if colour and style.value else text for text, style in parts
    )


class Output(Protocol):
    """What a status line needs of a terminal."""

    def write(self, text: str) -> None:
        """Write characters and control sequences."""

    def width(self) -> int:
        """Return the width [characters]."""


class StatusLine:
    """Shows a line in place; never wider than the window, so that it never wraps.

    Texts may contain colours.
    """

    def __init__(self, output: Output) -> None:
        self._output = output
        self._shown = ''

    def show(self, text: str) -> None:
        """Show a line, if it is not there yet."""
        line = fitted(text, self._output.width() - 1)
        if line != self._shown:
            self._output.write(CLEAR_LINE + line)
            self._shown = line

    def message(self, text: str) -> None:
        """Write lines above it, which stay."""
        self._output.write(f'{CLEAR_LINE}{text}\n{self._shown}')

    def end(self) -> None:
        """Move below the line, which stays as it is."""
        if self._shown:
            self._output.write('\n')
        self._shown = ''


def fitted(text: str, width: int) -> str:
    """Cut a line to some columns; colours are kept, and switched off where it is cut."""
    result: list[str] = []
    left, position = width, 0
    while position < len(text):
        control = _CONTROL.match(text, position)
        piece = control[0] if control else text[position]
        columns = 0 if control else _columns(piece)
        if columns > left:
            return ''.join(result) + (RESET if '\x1b' in text else '')
        result.append(piece)
        left -= columns
        position += len(piece)
    return ''.join(result)


def _columns(character: str) -> int:
    if unicodedata.combining(character):
        return 0
    return 2 if unicodedata.east_asian_width(character) in {'W', 'F'} else 1
