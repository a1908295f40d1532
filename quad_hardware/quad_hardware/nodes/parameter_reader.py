# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Declares parameters with meaning and range, and refuses misspelt ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import difflib
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node

from ..exceptions import CommandError

T = TypeVar('T')
Value = str | bool | int | float

_KINDS = {
    str: 'text',
    bool: 'true or false',
    int: 'whole number',
    float: 'number with a point',
}


class ParameterReader:
    """Declares one parameter after the other; all are read at the start only.

    Every method raises CommandError for a value of the wrong type or out of its range.
    """

    def __init__(self, node: Node) -> None:
        """Declare for a node."""
        self._node = node

    def text(self, name: str, default: str, meaning: str) -> str:
        """Declare and read a text."""
        descriptor = ParameterDescriptor(description=meaning, read_only=True)
        return str(self._declare(name, default, descriptor))

    def flag(self, name: str, *, default: bool, meaning: str) -> bool:
        """Declare and read a yes or no."""
        descriptor = ParameterDescriptor(description=meaning, read_only=True)
        return bool(self._declare(name, default, descriptor))

    def whole(self, name: str, default: int, span: tuple[int, int], meaning: str) -> int:
        """Declare and read a whole number within a range."""
        limits = [IntegerRange(from_value=span[0], to_value=span[1], step=0)]
        descriptor = ParameterDescriptor(description=meaning, read_only=True, integer_range=limits)
        return int(self._declare(name, default, descriptor))

    def number(
        self, name: str, default: float, span: tuple[float, float] | None, meaning: str
    ) -> float:
        """Declare and read a number, within a range where one is given."""
        limits = [FloatingPointRange(from_value=span[0], to_value=span[1])] if span else []
        descriptor = ParameterDescriptor(
            description=meaning, read_only=True, floating_point_range=limits
        )
        return float(self._declare(name, default, descriptor))

    def choice(self, name: str, default: str, values: Mapping[str, T], meaning: str) -> T:
        """Declare and read one of several names; return what it stands for.

        Raises:
            CommandError: It is none of them.
        """
        chosen = self.text(name, default, f'{meaning} ({", ".join(values)})')
        if chosen not in values:
            raise CommandError(f'{name} {chosen!r} is none of {", ".join(values)}')
        return values[chosen]

    def _declare(  # a parameter's value may be of any type
        self, name: str, default: Value, descriptor: ParameterDescriptor
    ) -> Any:  # noqa: ANN401
        try:
            return self._node.declare_parameter(name, default, descriptor).value
        except InvalidParameterTypeException as error:
            raise CommandError(
                f'{name} is no {_KINDS[type(default)]}; the default is {default!r}'
            ) from error
        except InvalidParameterValueException as error:
            raise CommandError(str(error)) from error


def refuse_misspelt(node: Node) -> None:
    """Refuse a parameter that looks like one of a node; rclpy ignores it.

    Args:
        node: A node that has declared all its parameters.

    Raises:
        CommandError: There is one; the message says what was meant.
    """
    overrides: Iterable[str] = node._parameter_overrides  # noqa: SLF001  # there is no public way
    known = list(node.get_parameters_by_prefix(''))
    for name in sorted(overrides):
        if node.has_parameter(name):
            continue
        close = difflib.get_close_matches(name, known, n=1, cutoff=0.8)
        if close:
            raise CommandError(f'unknown parameter {name!r}; did you mean {close[0]!r}?')
