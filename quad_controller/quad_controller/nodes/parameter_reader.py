# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Declares parameters with meaning and range, and refuses misspelt ones."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
import difflib
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node
from rclpy.parameter import Parameter

from ..exceptions import ParameterError

T = TypeVar('T')


class ParameterReader:
    """Declares one parameter after the other; most are read at the start only."""

    def __init__(self, node: Node) -> None:
        """Declare for a node."""
        self._node = node

    def text(self, name: str, default: str, meaning: str) -> str:
        """Declare and read a text."""
        return str(self._declare(name, default, ParameterDescriptor(description=meaning)))

    def flag(self, name: str, *, default: bool, meaning: str) -> bool:
        """Declare and read a yes or no."""
        return bool(self._declare(name, default, ParameterDescriptor(description=meaning)))

    def number(
        self,
        name: str,
        default: float,
        span: tuple[float, float],
        meaning: str,
        *,
        fixed: bool = True,
    ) -> float:
        """Declare and read a number within a range; one that is not fixed may be set later."""
        limits = [FloatingPointRange(from_value=span[0], to_value=span[1])]
        descriptor = ParameterDescriptor(description=meaning, floating_point_range=limits)
        return float(self._declare(name, default, descriptor, fixed=fixed))

    def numbers(self, name: str, meaning: str) -> tuple[float, ...]:
        """Declare and read a list of numbers, none by default."""
        # an empty list would be one of bytes; a type without a value may stay unset
        kind = Parameter.Type.DOUBLE_ARRAY
        value = self._declare(name, kind, ParameterDescriptor(description=meaning))
        return tuple(float(number) for number in value or ())

    def choice(self, name: str, default: str, values: Mapping[str, T], meaning: str) -> T:
        """Declare and read one of several names; return what it stands for.

        Raises:
            ParameterError: It is none of them.
        """
        chosen = self.text(name, default, f'{meaning} ({", ".join(values)})')
        if chosen not in values:
            raise ParameterError(f'{name} {chosen!r} is none of {", ".join(values)}')
        return values[chosen]

    def _declare(  # a parameter's value may be of any type
        self, name: str, default: object, descriptor: ParameterDescriptor, *, fixed: bool = True
    ) -> Any:  # noqa: ANN401
        descriptor.read_only = fixed
        try:
            return self._node.declare_parameter(name, default, descriptor).value
        except InvalidParameterTypeException as error:
            raise ParameterError(
                f'{error}; a number needs its decimal point, as in 1.0'
            ) from error
        except InvalidParameterValueException as error:
            raise ParameterError(str(error)) from error


def refuse_misspelt(node: Node) -> None:
    """Refuse a parameter that looks like one of a node; rclpy ignores it.

    Args:
        node: A node that has declared all its parameters.

    Raises:
        ParameterError: There is one; the message says what was meant.
    """
    overrides: Iterable[str] = node._parameter_overrides  # noqa: SLF001  # there is no public way
    known = list(node.get_parameters_by_prefix(''))
    for name in sorted(overrides):
        if node.has_parameter(name):
            continue
        close = difflib.get_close_matches(name, known, n=1, cutoff=0.8)
        if close:
            raise ParameterError(f'unknown parameter {name!r}; did you mean {close[0]!r}?')
