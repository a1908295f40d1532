# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Everything that quad_controller raises.

::

    QuadControllerError
    ├── ParameterError (ValueError)     a parameter is outside of what makes sense
    └── PolicyError (ValueError)        an ONNX policy does not fit this robot; names what differs

A robot description that is no quadruped's raises :class:`quad_description.DescriptionError`.
Requests that can be refused while the robot runs (a mode, a velocity) raise nothing: they are
answered with a reason. Arguments of the wrong kind from a *programmer* stay ``ValueError``.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, fields
from enum import Enum
from typing import Any, NamedTuple


class QuadControllerError(Exception):
    """Root of all errors of this package."""


class ParameterError(QuadControllerError, ValueError):
    """A parameter is outside of what makes sense.

    Scenarios: a duty of 1.2, a height that the legs do not reach, a misspelt name.
    """


class PolicyError(QuadControllerError, ValueError):
    """A policy does not fit this robot, or cannot be loaded.

    Scenarios: joints in the file that the robot lacks, another observation width, no metadata.
    """

    def __init__(self, message: str, reason: str = '') -> None:
        """Keep the reason beside the message, whose first line it is by default."""
        # what is wrong in one line; the message may have a table
        self.reason = reason or message.partition('\n')[0]
        super().__init__(message)


class CheckError(QuadControllerError):
    """A policy could not be tried; it says nothing about the policy.

    Scenarios: no MuJoCo, the simulated robot was lost on a machine that is far too busy.
    """


class Setting(NamedTuple):
    """A number, a switch or a choice that can be set."""

    name: str
    default: Any  # a number, a bool, or a member of an Enum
    span: tuple[float, float] | None  # of a number, both ends included
    meaning: str  # with its unit


def setting(default: float, least: float, most: float, meaning: str) -> Any:  # noqa: ANN401
    """Return a field of a dataclass that can be set."""
    return field(default=default, metadata={'setting': (default, (least, most), meaning)})


def switch(default: bool | Enum, meaning: str) -> Any:  # noqa: ANN401
    """Return a field of a dataclass that is on or off, or one of several."""
    return field(default=default, metadata={'setting': (default, None, meaning)})


def settings_of(kind: Any) -> Iterator[Setting]:  # noqa: ANN401  # a dataclass or one of its kind
    """Yield the fields of a dataclass that can be set."""
    for each in fields(kind):
        if 'setting' in each.metadata:
            yield Setting(each.name, *each.metadata['setting'])


def check_settings(values: Any, prefix: str = '') -> None:  # noqa: ANN401
    """Refuse numbers outside of their ranges.

    Raises:
        ParameterError: The message has name and range.
    """
    for name, _, span, _ in settings_of(values):
        value = getattr(values, name)
        if span is not None and not span[0] <= value <= span[1]:
            raise ParameterError(f'{prefix}{name} {value} is not within {span[0]} to {span[1]}')
