# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Collecting everything that is wrong with a configuration, instead of stopping at the first."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from .exceptions import ConfigError, Problem


@dataclass(frozen=True, slots=True)
class Place:
    """Where something is written."""

    file: Path = Path()
    line: int = 0  # line, from 1; 0 for the whole file
    key: str = ''  # path of the key, such as ``nodes.joint1.tpdo.1.mapping[0]``


class RefusedError(Exception):
    """A value cannot be taken. Never leaves this layer: readers turn it into a finding."""

    def __init__(self, message: str, remedy: str) -> None:
        super().__init__(message)
        self.message = message  # what is wrong, and with which value
        self.remedy = remedy  # what to do about it


class Findings:
    """Errors and warnings in the order in which they were found, each once.

    A value in ``defaults`` is read again for every device; what is wrong with it counts once, with
    the names of all that it is about.
    """

    def __init__(self) -> None:
        self._errors: dict[tuple[Place, str], Problem] = {}
        self._warnings: dict[tuple[Place, str], tuple[Problem, list[str]]] = {}

    def error(self, place: Place, message: str, remedy: str) -> None:
        """Add something that cannot be accepted."""
        problem = Problem(place.file, place.line, place.key, message, remedy)
        self._errors.setdefault((place, message), problem)

    def refuse(self, place: Place, reason: RefusedError) -> None:
        """Add a refused value as an error."""
        self.error(place, reason.message, reason.remedy)

    def warning(self, place: Place, message: str, remedy: str, about: str = '') -> None:
        """Add something odd that could be understood; ``about`` names an axis that it is about."""
        problem = Problem(place.file, place.line, place.key, message, remedy)
        _, names = self._warnings.setdefault((place, message), (problem, []))
        if about and about not in names:
            names.append(about)

    def extend(self, errors: Iterable[Problem] = (), warnings: Iterable[Problem] = ()) -> None:
        """Add what was found in another file."""
        for add, problems in ((self.error, errors), (self.warning, warnings)):
            for problem in problems:
                place = Place(problem.file, problem.line, problem.key)
                add(place, problem.message, problem.remedy)

    @property
    def errors(self) -> tuple[Problem, ...]:
        """All errors, in the order of the lines."""
        return tuple(sorted(self._errors.values(), key=lambda each: (str(each.file), each.line)))

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """What is to be looked at, as it was found; other files' included."""
        return tuple(
            replace(problem, message=f'{", ".join(names)}: {problem.message}')
            if names
            else problem
            for problem, names in self._warnings.values()
        )

    def raise_errors(self) -> None:
        """End with all errors, if there are any.

        Raises:
            ConfigError: There are; it lists them in the order of the lines.
        """
        if self._errors:
            raise ConfigError(self.errors)
