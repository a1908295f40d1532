# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Collecting everything that is wrong with a configuration, instead of stopping at the first."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

from ..exceptions import ConfigError, Problem


@dataclass(frozen=True, slots=True)
class Place:
    """Where something is written."""

    file: Path
    line: int = 0  # line, from 1; 0 for the whole file
    column: int = 0  # column, from 1; 0 for the whole line
    key: str = ''  # path of the key, such as ``nodes.joint1.tpdo.1.mapping[0]``


class RefusedError(Exception):
    """A value cannot be taken. Never leaves this layer: readers turn it into a finding."""

    def __init__(self, message: str, remedy: str) -> None:
        super().__init__(message)
        self.message = message  # what is wrong, and with which value
        self.remedy = remedy  # what to do about it


class Findings:
    """Errors and warnings in the order in which they were found, each once.

    A value in ``defaults`` is read again for every device; what is wrong with it counts once.
    """

    def __init__(self) -> None:
        self._errors: dict[tuple[Place, str], Problem] = {}
        self._warnings: dict[tuple[Place, str], Problem] = {}

    def error(self, place: Place, message: str, remedy: str) -> None:
        """Add something that cannot be accepted."""
        problem = Problem(place.file, place.line, place.key, message, remedy)
        self._errors.setdefault((place, message), problem)

    def refuse(self, place: Place, reason: RefusedError) -> None:
        """Add a refused value as an error."""
        self.error(place, reason.message, reason.remedy)

    def warning(self, place: Place, message: str, remedy: str) -> None:
        """Add something odd that could be understood."""
        problem = Problem(place.file, place.line, place.key, message, remedy)
        self._warnings.setdefault((place, message), problem)

    def extend_errors(self, problems: Iterable[Problem]) -> None:
        """Add the errors of another file."""
        for problem in problems:
            self.error(_place(problem), problem.message, problem.remedy)

    def extend_warnings(self, problems: Iterable[Problem]) -> None:
        """Add the warnings of another file."""
        for problem in problems:
            self.warning(_place(problem), problem.message, problem.remedy)

    @property
    def errors(self) -> tuple[Problem, ...]:
        """All errors, in the order of the lines."""
        return tuple(sorted(self._errors.values(), key=_order))

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """What is to be looked at, as it was found; other files' included."""
        return tuple(self._warnings.values())

    def raise_errors(self) -> None:
        """End with all errors, if there are any.

        Raises:
            ConfigError: There are; it lists them in the order of the lines.
        """
        if self._errors:
            raise ConfigError(self.errors)


def _place(problem: Problem) -> Place:
    return Place(problem.file, problem.line, key=problem.key)


def _order(problem: Problem) -> tuple[str, int]:
    return str(problem.file), problem.line
