# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What is wrong with a robot folder, in types."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
import textwrap


class Severity(Enum):
    """How bad it is."""

    ERROR = 'error'
    """The robot does not run, or not as it is described."""

    WARNING = 'warning'
    """It runs; something will surprise."""


@dataclass(frozen=True, slots=True)
class Finding:
    """One thing that is wrong.

    Attributes:
        severity: How bad it is.
        place: File, and what in it.
        problem: What is wrong.
        remedy: What to do.
    """

    severity: Severity
    place: str
    problem: str
    remedy: str

    def __str__(self) -> str:
        """Format it in two lines or more."""
        remedy = textwrap.indent(self.remedy, '    ')
        return f'{self.severity.value}: {self.place}: {self.problem}\n{remedy}'


def error(place: str, problem: str, remedy: str) -> Finding:
    """Return an error."""
    return Finding(Severity.ERROR, place, problem, remedy)


def warning(place: str, problem: str, remedy: str) -> Finding:
    """Return a warning."""
    return Finding(Severity.WARNING, place, problem, remedy)
