# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Declares parameters with description and range; reads and checks their values."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Mapping
import difflib
from enum import Enum
from functools import partial
import math
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node
from rclpy.parameter import Parameter

from robot_primitives import settings_of

ALIKE = 0.8  # of SequenceMatcher: one letter in five; short names for other nodes pass
RCLPY_PREFIX = 'qos_overrides.'  # declared with a topic, so some of them later than our look
Choice = TypeVar('Choice')
Kind = TypeVar('Kind')
Number = TypeVar('Number', int, float)
Value = TypeVar('Value')
_ALIKE = 0.6  # what is chosen from is known, so the suggestion may be a bold one


class ParameterError(ValueError):
    """A parameter of a node is misspelt, or its value is not allowed.

    Scenarios: a text instead of a number, a rate out of range, an unknown choice.
    """


def refuse_misspelt(node: Node, similar: Collection[str] = ()) -> list[str]:
    """Reject a parameter with a name similar to one of the node's; rclpy would ignore it.

    Other unknown names pass: a parameter file may be for several nodes. ``similar`` are names of
    other programs that look alike by chance. Call it after all parameters are declared.

    Returns:
        The given names that the node has not declared; they have no effect on it.

    Raises:
        ParameterError: A name looks misspelt; the message suggests the right one.
    """
    given = node._parameter_overrides  # noqa: SLF001  # there is no public way to read it
    unknown = [
        name
        for name in given
        if not node.has_parameter(name) and not name.startswith(RCLPY_PREFIX)
    ]
    known = node.get_parameters_by_prefix('')
    refuse_similar(
        (name for name in unknown if name not in similar),
        (name for name in known if not name.startswith(RCLPY_PREFIX)),
    )
    return unknown


def refuse_similar(unknown: Iterable[str], known: Iterable[str]) -> None:
    """Reject an unknown name that looks like a known one.

    Raises:
        ParameterError: A name looks misspelt; the message suggests the right one.
    """
    names = list(known)
    for name in sorted(unknown):
        if meant := closest(name, names):
            raise ParameterError(f'unknown parameter {name!r}; did you mean {meant!r}?')


def closest(name: str, names: Iterable[str], alike: float = ALIKE) -> str:
    """Return the name most similar to another, at least `alike` (0 to 1); empty for none."""
    return next(iter(difflib.get_close_matches(name, list(names), n=1, cutoff=alike)), '')


class ParameterReader:
    """Declares the parameters of a node and returns their values.

    Every method raises :class:`.ParameterError` if the given value has the wrong type or is out of
    range; the message has name, value and what is allowed. An integer is accepted for any number.
    """

    def __init__(self, node: Node, prefix: str = '', *, fixed: bool = True) -> None:
        """Declare for a node, with a prefix and its dot before each name.

        ``fixed`` parameters are read only at the start, and cannot be changed later.
        """
        self._node = node
        self._prefix = prefix
        self._fixed = fixed

    def settings(self, kind: type[Kind], prefix: str = '', **given: Any) -> Kind:  # noqa: ANN401
        """Declare and read the settings of a dataclass, except those ``given``; return it."""
        values = given
        for name, default, span, meaning in settings_of(kind):
            path = prefix + name
            if name in given:
                continue
            if isinstance(default, bool):
                values[name] = self.flag(path, meaning, default=default)
            elif isinstance(default, Enum):
                choices = {choice.value: choice for choice in type(default)}
                values[name] = self.choice(path, default.value, choices, meaning)
            elif isinstance(default, str):
                values[name] = self.text(path, default, meaning)
            elif isinstance(default, int) and span is not None:
                ends = int(span[0]), int(span[1])
                values[name] = self.whole(path, default, ends, meaning)
            else:
                values[name] = self.number(path, default, span, meaning)
        return kind(**values)

    def text(self, name: str, default: str, meaning: str) -> str:
        """Declare and read a text."""
        return self._declare(name, self._given(name, default, _text), meaning)

    def flag(self, name: str, meaning: str, *, default: bool) -> bool:
        """Declare and read a switch."""
        return self._declare(name, self._given(name, default, _flag), meaning)

    def whole(self, name: str, default: int, span: tuple[int, int], meaning: str) -> int:
        """Declare and read a whole number within a range."""
        limits = IntegerRange(from_value=span[0], to_value=span[1])
        value = self._given(name, default, partial(_whole, span=span))
        return self._declare(name, value, meaning, limits)

    def number(
        self, name: str, default: float, span: tuple[float, float] | None, meaning: str
    ) -> float:
        """Declare and read a number, within a range where one is given."""
        limits = FloatingPointRange(from_value=span[0], to_value=span[1]) if span else None
        value = self._given(name, default, partial(_number, span=span))
        return self._declare(name, value, meaning, limits)

    def numbers(self, name: str, meaning: str) -> tuple[float, ...]:
        """Declare and read a list of finite numbers, none by default."""
        read = self._given(name, (), _numbers)
        # an empty list would be one of bytes; a type without a value may stay unset
        self._declare(name, list(read) or Parameter.Type.DOUBLE_ARRAY, meaning)
        return read

    def texts(self, name: str, default: list[str], meaning: str) -> list[str]:
        """Declare and read a list of texts; an empty default is not possible: it has no type."""
        read = self._given(name, default, _texts)
        self._declare(name, read or Parameter.Type.STRING_ARRAY, meaning)
        return read

    def choice(
        self,
        name: str,
        default: str,
        values: Mapping[str, Choice],
        meaning: str,
    ) -> Choice:
        """Declare and read one of several names; return its entry in ``values``."""
        chosen, full = self._given(name, default, _text), self._prefix + name
        self._declare(name, chosen, f'{meaning} ({", ".join(values)})')
        if chosen not in values:
            meant = closest(chosen, values, _ALIKE)
            question = f'; did you mean {meant!r}?' if meant else ''
            raise ParameterError(f'{full} is {chosen!r}: it must be {_or(list(values))}{question}')
        return values[chosen]

    def _given(self, name: str, default: object, check: Callable[[str, object], Value]) -> Value:
        """Return the given value, else the default, after a check."""
        name = self._prefix + name
        given = self._node._parameter_overrides.get(name)  # noqa: SLF001  # no public way to read it
        return check(name, default if given is None else given.value)

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
        name = self._prefix + name
        self._node.declare_parameter(name, value, descriptor, ignore_override=True)
        return value


def _of_kind(
    kind: type[Value] | tuple[type[Value], ...], what: str, name: str, value: object
) -> Value:
    # a bool is an int for Python
    if not isinstance(value, kind) or (isinstance(value, bool) and kind is not bool):
        raise ParameterError(f'{name} is {value!r}: it must be {what}')
    return value


def _text(name: str, value: object) -> str:
    return _of_kind(str, 'a text', name, value)


def _flag(name: str, value: object) -> bool:
    return _of_kind(bool, 'true or false', name, value)


def _whole(name: str, value: object, span: tuple[int, int]) -> int:
    return _within(_of_kind(int, 'a whole number', name, value), name, span)


def _number(name: str, value: object, span: tuple[float, float] | None = None) -> float:
    number = _of_kind((int, float), 'a number', name, value)
    if math.isnan(number):
        raise ParameterError(f'{name} is nan: it must be a number')
    return float(_within(number, name, span) if span else number)


def _numbers(name: str, value: object) -> tuple[float, ...]:
    read = tuple(_number(name, each) for each in _items(name, value, 'numbers'))
    if not all(map(math.isfinite, read)):
        raise ParameterError(f'{name} is {list(read)}: all of them must be finite')
    return read


def _texts(name: str, value: object) -> list[str]:
    return [_text(name, each) for each in _items(name, value, 'texts')]


def _items(name: str, value: object, what: str) -> list[object]:
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise ParameterError(f'{name} is {value!r}: it must be a list of {what}')
    return list(value)


def _within(value: Number, name: str, span: tuple[Number, Number]) -> Number:
    low, high = span
    if not low <= value <= high:
        raise ParameterError(f'{name} is {value}: it must be {low} to {high}')
    return value


def _or(words: list[str]) -> str:
    return ' or '.join(filter(None, [', '.join(words[:-1]), words[-1]]))


def given_values(node: Node) -> dict[str, object]:
    """Return all parameter overrides of a node by name, declared or not."""
    given = node._parameter_overrides  # noqa: SLF001  # no public way to read it
    return {name: parameter.value for name, parameter in given.items()}


def give_defaults(node: Node, values: Mapping[str, object]) -> None:
    """Add parameter overrides to a node for names that were not given.

    Call it before they are declared. Values of types that no parameter has are skipped.
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
    """Declare parameters that were given but not declared yet, with their given values."""
    given = node._parameter_overrides  # noqa: SLF001
    for name in names:
        if name in given and not node.has_parameter(name):
            descriptor = ParameterDescriptor(description=meaning, read_only=True)
            node.declare_parameter(name, given[name].value, descriptor, ignore_override=True)
