# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Typed settings: fields of a dataclass with default, range and meaning, declared once.

``ParameterReader.settings`` of node_runner declares them as ROS parameters.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import field, fields
from enum import Enum
from typing import Any, NamedTuple


class Setting(NamedTuple):
    """A field of a dataclass that can be set."""

    name: str
    default: Any  # a number, a bool, a text, or a member of an Enum
    span: tuple[float, float] | None  # of a number, both ends included
    meaning: str  # with its unit


def setting(default: float, least: float, most: float, meaning: str) -> Any:  # noqa: ANN401
    """Return a field for a number; an integer if the default is an int."""
    return field(default=default, metadata={'setting': (default, (least, most), meaning)})


def switch(default: bool | Enum | str, meaning: str) -> Any:  # noqa: ANN401
    """Return a field for a bool, an enum or a text."""
    return field(default=default, metadata={'setting': (default, None, meaning)})


def settings_of(kind: Any) -> Iterator[Setting]:  # noqa: ANN401  # a dataclass or one of its kind
    """Yield the fields of a dataclass that can be set."""
    for each in fields(kind):
        if 'setting' in each.metadata:
            yield Setting(each.name, *each.metadata['setting'])


def settings_problem(values: Any) -> str:  # noqa: ANN401
    """Name a number that is out of range, with the range; empty if there is none."""
    for name, _, span, _ in settings_of(values):
        value = getattr(values, name)
        if span is not None and not span[0] <= value <= span[1]:
            return f'{name} {value} is not within {span[0]} to {span[1]}'
    return ''
