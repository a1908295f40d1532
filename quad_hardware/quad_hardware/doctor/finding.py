# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a check has found."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


class Severity(Enum):
    """How bad it is."""

    GOOD = 'ok'
    NOTE = 'note'
    WARNING = 'warning'
    ERROR = 'error'


@dataclass(frozen=True, slots=True)
class Finding:
    """One line of the report."""

    severity: Severity  # how bad it is
    subject: str  # what was looked at
    message: str  # what was found
    remedy: str = ''  # what to do about it; empty where nothing is to be done

    def __str__(self) -> str:
        """Return the finding as lines of text."""
        line = f'{self.severity.value:>7}  {self.subject}: {self.message}'
        return f'{line}\n{"":9}-> {self.remedy}' if self.remedy else line


def good(subject: str, message: str) -> Finding:
    """Return that something is as it should be."""
    return Finding(Severity.GOOD, subject, message)


def note(subject: str, message: str, remedy: str = '') -> Finding:
    """Return something worth knowing."""
    return Finding(Severity.NOTE, subject, message, remedy)


def warning(subject: str, message: str, remedy: str) -> Finding:
    """Return something that may be wrong."""
    return Finding(Severity.WARNING, subject, message, remedy)


def error(subject: str, message: str, remedy: str) -> Finding:
    """Return something that cannot work."""
    return Finding(Severity.ERROR, subject, message, remedy)
