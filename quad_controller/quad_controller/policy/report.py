# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a check of a policy found: a table with a row for each thing that must agree."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum


class Verdict(Enum):
    """What follows from a row."""

    OK = 'ok'
    WARN = 'warn'
    REFUSE = 'REFUSE'


@dataclass(frozen=True, slots=True)
class Row:
    """One thing that was looked at."""

    subject: str  # what
    expected: str  # what it should be
    found: str  # what it is
    verdict: Verdict  # what follows


@dataclass(frozen=True, slots=True)
class Report:
    """All rows."""

    rows: tuple[Row, ...]

    @property
    def refused(self) -> bool:
        """Whether the policy must not be followed."""
        return any(row.verdict is Verdict.REFUSE for row in self.rows)

    @property
    def reason(self) -> str:
        """What the policy is refused for, in one line."""
        return '; '.join(
            f'{row.subject}: {row.found} instead of {row.expected}'
            for row in self.rows
            if row.verdict is Verdict.REFUSE
        )

    def __str__(self) -> str:
        """Return a table for people."""
        rows = [('check', 'expected', 'found', '')]
        rows += [(row.subject, row.expected, row.found, row.verdict.value) for row in self.rows]
        return table_text(rows)


def table_text(rows: Sequence[Sequence[str]], *, numbers: bool = False, widest: int = 1000) -> str:
    """Return a table for people: columns stand under each other.

    Args:
        rows: Their cells; the first row has the headings.
        numbers: All columns but the first are aligned at the right.
        widest: A cell with more characters runs over, and moves no other line.
    """
    widths = [min(max(map(len, column)), widest) for column in zip(*rows, strict=True)]
    return '\n'.join(
        '  '.join(
            cell.rjust(width) if numbers and column else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    )
