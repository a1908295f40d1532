# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Declares parameters with meaning and range, and reads them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from . import parameter_values

Choice = TypeVar('Choice')
Value = TypeVar('Value')


class ParameterReader:
    """Declares one parameter after the other.

    Every method raises :class:`.ParameterError` when the value that was given is of another kind
    or out of its range; the message has name, value and what it must be. A whole number does for
    any number.
    """

    def __init__(self, node: Node, prefix: str = '', *, fixed: bool = True) -> None:
        """Declare for a node.

        Args:
            node: The node.
            prefix: Before each name, with its dot.
            fixed: They are read at the start only, and cannot be changed later.
        """
        self._node = node
        self._prefix = prefix
        self._fixed = fixed

    def text(self, name: str, default: str, meaning: str) -> str:
        """Declare and read a text."""
        name, value = self._given(name, default)
        return self._declare(name, parameter_values.text(name, value), meaning)

    def flag(self, name: str, meaning: str, *, default: bool) -> bool:
        """Declare and read a switch."""
        name, value = self._given(name, default)
        return self._declare(name, parameter_values.flag(name, value), meaning)

    def whole(self, name: str, default: int, span: tuple[int, int], meaning: str) -> int:
        """Declare and read a whole number within a range."""
        name, value = self._given(name, default)
        limits = IntegerRange(from_value=span[0], to_value=span[1])
        return self._declare(name, parameter_values.whole(name, value, span), meaning, limits)

    def number(
        self, name: str, default: float, span: tuple[float, float] | None, meaning: str
    ) -> float:
        """Declare and read a number, within a range where one is given."""
        name, value = self._given(name, default)
        limits = FloatingPointRange(from_value=span[0], to_value=span[1]) if span else None
        return self._declare(name, parameter_values.number(name, value, span), meaning, limits)

    def numbers(self, name: str, meaning: str) -> tuple[float, ...]:
        """Declare and read a list of numbers, none by default."""
        name, value = self._given(name, ())
        read = parameter_values.numbers(name, value)
        # an empty list would be one of bytes; a type without a value may stay unset
        self._declare(name, list(read) or Parameter.Type.DOUBLE_ARRAY, meaning)
        return read

    def texts(self, name: str, default: list[str], meaning: str) -> list[str]:
        """Declare and read a list of texts; the default is never empty, which has no type."""
        name, value = self._given(name, default)
        read = parameter_values.texts(name, value)
        self._declare(name, read or Parameter.Type.STRING_ARRAY, meaning)
        return read

    def choice(
        self,
        name: str,
        default: str,
        values: Mapping[str, Choice],
        meaning: str,
    ) -> Choice:
        """Declare and read one of several names; return what it stands for.

        Args:
            name: Of the parameter.
            default: One of the names.
            values: What the names stand for.
            meaning: Of the parameter.
        """
        name, value = self._given(name, default)
        chosen = parameter_values.text(name, value)
        self._declare(name, chosen, f'{meaning} ({", ".join(values)})')
        return parameter_values.choice(name, chosen, values)

    def _given(self, name: str, default: object) -> tuple[str, object]:
        """Return the full name, and the value from outside or else the default."""
        name = self._prefix + name
        given = self._node._parameter_overrides.get(name)  # noqa: SLF001  # no public way to read it
        return name, default if given is None else given.value

    def _declare(
        self,
        name: str,
        value: Value,
        meaning: str,
        limits: FloatingPointRange | IntegerRange | None = None,
    ) -> Value:
        descriptor = ParameterDescriptor(description=meaning, read_only=self._fixed)
        if isinstance(limits, IntegerRange):
            descriptor.integer_range = [limits]
        elif limits is not None:
            descriptor.floating_point_range = [limits]
        # the value from outside is in it already, and of the right kind
        self._node.declare_parameter(name, value, descriptor, ignore_override=True)
        return value


def given_values(node: Node) -> dict[str, object]:
    """Return all parameters that a node was given from outside, declared or not, by name."""
    given = node._parameter_overrides  # noqa: SLF001  # no public way to read it
    return {name: parameter.value for name, parameter in given.items()}


def give_defaults(node: Node, values: Mapping[str, object]) -> None:
    """Give a node parameters that nobody gave it, as if they came from outside.

    Args:
        node: The node; it has not declared them yet.
        values: Values by name; those of kinds that no parameter has are passed over.
    """
    given = node._parameter_overrides  # noqa: SLF001
    for name, value in values.items():
        if name in given or value is None or (isinstance(value, list) and not value):
            continue
        try:
            given[name] = Parameter(name, value=value)
        except TypeError:
            continue


def declare_given(node: Node, names: Iterable[str], meaning: str) -> None:
    """Declare parameters that were given and that nobody has declared, as they are.

    Args:
        node: The node.
        names: Their names; those that are declared already are passed over.
        meaning: Of all of them.
    """
    given = node._parameter_overrides  # noqa: SLF001
    for name in names:
        if name in given and not node.has_parameter(name):
            descriptor = ParameterDescriptor(description=meaning, read_only=True)
            node.declare_parameter(name, given[name].value, descriptor, ignore_override=True)
