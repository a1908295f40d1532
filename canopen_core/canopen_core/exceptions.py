# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Exceptions of the CANopen packages, and findings in configuration files.

::

    CanopenError
    ├── ConfigError (ValueError)     a bus.yml or EDS is wrong; lists every problem
    ├── BusError (OSError)           a CAN interface cannot be opened, or refuses a frame
    ├── OtherMasterError             another master controls this bus, or may control it
    ├── CodecError (ValueError)      a value does not fit its type, or bytes are not a message
    ├── ObjectError (LookupError)    a device has no object of that name or number
    ├── SdoError                     a device did not do what an SDO requested
    │   ├── SdoAbortError            the device (or we) aborted the transfer with a code
    │   └── SdoTimeoutError (TimeoutError)   the device did not answer
    ├── BootError                    a device did not boot; names the phase
    ├── DriveError                   a drive refused a command or did not reach a state in time
    └── LifecycleError               a managed node cannot make this transition now

Arguments of the wrong kind from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path


class CanopenError(Exception):
    """Root of all errors of the CANopen packages."""


@dataclass(frozen=True, slots=True)
class Problem:
    """Something wrong with a configuration file."""

    file: Path
    line: int  # line, from 1; 0 when the whole file is meant
    key: str  # path of the key, such as ``nodes.joint1.tpdo.1.mapping``; empty when none applies
    message: str  # what is wrong, and with which value
    remedy: str  # what to do about it

    def __str__(self) -> str:
        """Return it as compilers write it: file, line, key, message, remedy."""
        place = f'{self.file}:{self.line}' if self.line else str(self.file)
        key = f'{self.key}: ' if self.key else ''
        remedy = f' ({self.remedy})' if self.remedy else ''
        return f'{place}: {key}{self.message}{remedy}'


class ConfigError(CanopenError, ValueError):
    """A bus.yml or EDS is wrong. The message lists every problem that was found, one per line.

    Scenarios: a file is missing, a key is unknown, a value does not fit, two devices share an id.
    """

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)  # each with file, line, key, message and remedy
        super().__init__('\n'.join(str(problem) for problem in self.problems))


class BusError(CanopenError, OSError):
    """A CAN interface cannot be opened or refuses a frame.

    Scenarios: unknown interface name, interface down, transmit queue full.
    """


class OtherMasterError(CanopenError):
    """Another master controls this bus, or may control it; the message says which."""


class CodecError(CanopenError, ValueError):
    """A value does not fit its data type, or received bytes are no valid message."""


class ObjectError(CanopenError, LookupError):
    """A device has no object of that name or number; the message names similar ones."""


class SdoError(CanopenError):
    """A device did not do what an SDO requested."""


class SdoTimeoutError(SdoError, TimeoutError):
    """A device did not answer an SDO request in time."""


class SdoAbortError(SdoError):
    """An SDO transfer was aborted."""

    def __init__(self, message: str, code: int) -> None:
        super().__init__(message)
        self.code = code  # abort code as transmitted (CiA 301, table 22)


class BootError(CanopenError):
    """A device did not boot.

    Scenarios: no answer, unexpected identity, configuration refused.
    """


class DriveError(CanopenError):
    """A drive refused a command or did not reach the wanted state in time."""


class LifecycleError(CanopenError):
    """A managed node cannot make this transition now; the message names the possible ones."""


@dataclass(frozen=True, slots=True)
class Place:
    """Location in a configuration file."""

    file: Path = Path()
    line: int = 0  # line, from 1; 0 for the whole file
    key: str = ''  # path of the key, such as ``nodes.joint1.tpdo.1.mapping[0]``


class RefusedError(Exception):
    """A value is invalid. Internal: readers turn it into a finding."""

    def __init__(self, message: str, remedy: str) -> None:
        super().__init__(message)
        self.message = message  # what is wrong, and with which value
        self.remedy = remedy  # what to do about it


class Findings:
    """Errors and warnings in the order in which they were found, without duplicates.

    A value in ``defaults`` is read again for every device; its finding is listed once, with the
    names of all affected devices.
    """

    def __init__(self) -> None:
        self._errors: dict[tuple[Place, str], Problem] = {}
        self._warnings: dict[tuple[Place, str], tuple[Problem, list[str]]] = {}

    def error(self, place: Place, message: str, remedy: str) -> None:
        """Add an error."""
        problem = Problem(place.file, place.line, place.key, message, remedy)
        self._errors.setdefault((place, message), problem)

    def refuse(self, place: Place, reason: RefusedError) -> None:
        """Add a refused value as an error."""
        self.error(place, reason.message, reason.remedy)

    def warning(self, place: Place, message: str, remedy: str, about: str = '') -> None:
        """Add a warning; ``about`` names the affected axis."""
        problem = Problem(place.file, place.line, place.key, message, remedy)
        _, names = self._warnings.setdefault((place, message), (problem, []))
        if about and about not in names:
            names.append(about)

    def extend(self, errors: Iterable[Problem] = (), warnings: Iterable[Problem] = ()) -> None:
        """Add the findings of another file."""
        for add, problems in ((self.error, errors), (self.warning, warnings)):
            for problem in problems:
                place = Place(problem.file, problem.line, problem.key)
                add(place, problem.message, problem.remedy)

    @property
    def errors(self) -> tuple[Problem, ...]:
        """All errors, ordered by line."""
        return tuple(sorted(self._errors.values(), key=lambda each: (str(each.file), each.line)))

    @property
    def warnings(self) -> tuple[Problem, ...]:
        """All warnings in the order found, including those of other files."""
        return tuple(
            replace(problem, message=f'{", ".join(names)}: {problem.message}')
            if names
            else problem
            for problem, names in self._warnings.values()
        )

    def raise_errors(self) -> None:
        """Raise all errors as one ConfigError, if there are any.

        Raises:
            ConfigError: There are errors; the message lists them ordered by line.
        """
        if self._errors:
            raise ConfigError(self.errors)
