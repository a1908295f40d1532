# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Exceptions of arm_model, and the root of those of the packages above it.

::

    ArmError
    ├── ModelError (ValueError)     description, SRDF and limits do not make an arm
    │   └── LimitsError             the limits file is invalid
    ├── SceneError (ValueError)     an object does not fit into a planning scene
    │   ├── LinkNameError           no such link
    │   └── ObjectNameError         no such object, or its name is empty or taken
    └── CommandError (ValueError)   a request is refused before anything moves

Arguments of the wrong kind from a *programmer* stay ``ValueError``/``TypeError``.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from urdf_reader import DescriptionError


class ArmError(Exception):
    """Root of all errors of arm_model and of the packages above it."""


class ModelError(ArmError, ValueError):
    """URDF, SRDF and limits do not define an arm."""


class LimitsError(ModelError):
    """The limits file cannot be read, or lacks required entries.

    Attributes:
        problems: What is wrong, one sentence each.
    """

    def __init__(self, *problems: str) -> None:
        super().__init__('; '.join(problems))
        self.problems = problems


class SceneError(ArmError, ValueError):
    """An object does not fit into a planning scene."""


class LinkNameError(SceneError):
    """A link of a scene is unknown."""


class ObjectNameError(SceneError):
    """The name of an object is unknown, empty or taken."""


class CommandError(ArmError, ValueError):
    """A request is refused before anything moves."""


@contextmanager
def description_refused(place: str = '') -> Iterator[None]:
    """Convert errors in URDF or SRDF to a ModelError; the message names the place."""
    try:
        yield
    except DescriptionError as error:
        raise ModelError(f'{place}: {error}' if place else str(error)) from error


@contextmanager
def limits_refused(path: Path | str) -> Iterator[None]:
    """Add the name of the limits file to errors about it."""
    try:
        yield
    except LimitsError as error:
        raise LimitsError(*(f'{path}: {problem}' for problem in error.problems)) from error
