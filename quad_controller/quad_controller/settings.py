# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What can be set: default, range and meaning of each, declared once as a field."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, fields
from enum import Enum
from typing import Any, NamedTuple

from .exceptions import ParameterError


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
