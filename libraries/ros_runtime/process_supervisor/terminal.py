# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Capabilities of a terminal, and output lines prefixed with the name of their process."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
import contextlib
from dataclasses import dataclass
import re
from typing import TextIO

from .supervision import Notice, Severity

RESET = '\x1b[0m'
BOLD = '\x1b[1m'
YELLOW = '\x1b[33m'
RED = '\x1b[31m'

NAME_COLOURS = ('\x1b[36m', '\x1b[32m', '\x1b[35m', '\x1b[34m', '\x1b[96m', '\x1b[92m')
"""Colours of process names, in the order of the bring-up."""

SEVERITY_COLOURS = {Severity.WARNING: YELLOW, Severity.ERROR: RED}  # colours of notices

ROS_SEVERITY = re.compile(r'^\[(DEBUG|INFO|WARN|ERROR|FATAL)\]')
"""Severity at the start of a line of rcutils logging, in the format that the bring-up sets."""

LOUD_SEVERITIES = {'WARN': Severity.WARNING, 'ERROR': Severity.ERROR, 'FATAL': Severity.ERROR}
"""How loud the severities of rcutils are here; the others are information."""


def wants_colour(stream: TextIO, environment: Mapping[str, str]) -> bool:
    """Return whether output shall be coloured.

    Args:
        stream: Where it goes.
        environment: Variables: NO_COLOR (https://no-color.org) and TERM count.
    """
    smart = environment.get('TERM', 'dumb') not in {'dumb', 'unknown', ''}
    return stream.isatty() and not environment.get('NO_COLOR') and smart


def severity_of(line: str) -> Severity:
    """Return the severity of an output line of a ROS node.

    Args:
        line: A line of its output; one that is no log line, such as that of a traceback, is a
            warning: nothing of the kind is expected.
    """
    match = ROS_SEVERITY.match(line)
    return LOUD_SEVERITIES.get(match[1], Severity.INFO) if match else Severity.WARNING


@dataclass(frozen=True, slots=True)
class Painter:
    """Puts names in front of lines, all as wide as the widest.

    Attributes:
        own: Name of the supervising program.
        names: Names of its processes.
        colour: Use colours.
    """

    own: str
    names: Sequence[str]
    colour: bool

    def line(self, name: str, text: str) -> str:
        """Format a line of a process."""
        prefix = self._prefix(name)
        if not self.colour:
            return f'{prefix} {text}'
        shade = NAME_COLOURS[self.names.index(name) % len(NAME_COLOURS)]
        body = SEVERITY_COLOURS.get(severity_of(text), '')
        return f'{shade}{prefix}{RESET} {body}{text}{RESET if body else ""}'

    def notice(self, notice: Notice) -> str:
        """Format a notice of the program itself."""
        prefix = self._prefix(self.own)
        if not self.colour:
            mark = {Severity.WARNING: 'warning: ', Severity.ERROR: 'error: '}
            return f'{prefix} {mark.get(notice.severity, "")}{notice.text}'
        return f'{BOLD}{prefix} {SEVERITY_COLOURS.get(notice.severity, "")}{notice.text}{RESET}'

    def _prefix(self, name: str) -> str:
        width = max(len(each) for each in (self.own, *self.names))
        return f'{name:<{width}} |'


class LineWriter:
    """Writes lines at once; goes on silently when their reader is gone."""

    def __init__(self, stream: TextIO) -> None:
        """Write to a stream."""
        self._stream = stream

    def __call__(self, line: str) -> None:
        """Write a line."""
        # a closed terminal or pipe must not keep us from stopping the drives
        with contextlib.suppress(OSError, ValueError):
            self._stream.write(line + '\n')
            self._stream.flush()
