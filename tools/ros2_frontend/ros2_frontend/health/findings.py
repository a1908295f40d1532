# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a check found and what a report contains."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Severity(Enum):
    """How bad a finding is; the value is the word that is printed."""

    WARNING = 'UserWarning'
    ERROR = 'UserWarning: ERROR'


@dataclass(frozen=True, slots=True)
class Finding:
    """Something that may be wrong.

    Attributes:
        severity: How bad it is.
        text: What it is, and what to do about it.
    """

    severity: Severity
    text: str


@dataclass(frozen=True, slots=True)
class Report:
    """A table of facts.

    Attributes:
        title: Its head.
        rows: Names and values; a name may come again and again.
    """

    title: str
    rows: tuple[tuple[str, object], ...]

    def text(self) -> str:
        """The table, aligned, with an empty line before it."""
        width = max((len(name) for name, _ in self.rows), default=0)
        return '\n'.join(
            [f'\n   {self.title}', *(f'{name:{width}}: {value}' for name, value in self.rows)]
        )


def warning(text: str) -> Finding:
    """A finding that does not fail a check, unless `--include-warnings`.

    Args:
        text: What it is.

    Returns:
        The finding.
    """
    return Finding(Severity.WARNING, text)


def error(text: str) -> Finding:
    """A finding that fails a check.

    Args:
        text: What it is.

    Returns:
        The finding.
    """
    return Finding(Severity.ERROR, text)
