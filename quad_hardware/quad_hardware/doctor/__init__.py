# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Diagnoses the chain from the serial port to the transforms, and suggests remedies."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum
from functools import partial


class Severity(Enum):
    """Severity of a finding."""

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


good = partial(Finding, Severity.GOOD)  # as it should be
note = partial(Finding, Severity.NOTE)  # worth knowing
warning = partial(Finding, Severity.WARNING)  # may be wrong
error = partial(Finding, Severity.ERROR)  # cannot work
