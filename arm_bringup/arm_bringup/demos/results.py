# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a demo found out: rows of the summary, and what went wrong."""

from __future__ import annotations

from dataclasses import dataclass, field


@dataclass(slots=True)
class Results:
    """Filled while a demo runs.

    Attributes:
        rows: Name and figures of each part, in their order.
        problems: What went wrong.
        warnings: What is worth a look.
    """

    rows: list[tuple[str, str]] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)

    def add(self, name: str, figures: str, problem: str = '') -> None:
        """Take in a part.

        Args:
            name: What it was.
            figures: What was measured.
            problem: What went wrong; empty when all went well.
        """
        self.rows.append((name, figures))
        if problem:
            self.problem(name, problem)

    def problem(self, name: str, words: str) -> None:
        """Take in what went wrong.

        Args:
            name: In which part.
            words: What it was.
        """
        self.problems.append(f'{name}: {words}')

    def lines(self) -> list[str]:
        """Return the summary."""
        width = max((len(name) for name, _ in self.rows), default=0)
        return [f'{name:<{width}}  {figures}' for name, figures in self.rows]
