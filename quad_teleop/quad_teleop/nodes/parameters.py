# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of the nodes: declared with meaning and range, wrong ones refused with words."""

from __future__ import annotations

from collections.abc import Iterable
import difflib
import math

from rcl_interfaces.msg import ParameterDescriptor
from rclpy.node import Node

from ..exceptions import SettingError


def number(
    node: Node, name: str, default: float, limits: tuple[float, float], meaning: str
) -> float:
    """Declare a number that is set at the start.

    Args:
        node: The node.
        name: The parameter.
        default: Its default.
        limits: Smallest and largest value.
        meaning: What it is, with its unit.

    Raises:
        SettingError: It was set to no number, or to one out of range.
    """
    low, high = limits
    value = _declare(node, name, default, f'{meaning}; {low} to {high}')
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise SettingError(f'{name} is {value!r}: it must be a number')
    if not (math.isfinite(value) and low <= value <= high):
        raise SettingError(f'{name} is {value}: it must be {low} to {high}')
    return float(value)


def flag(node: Node, name: str, default: bool, meaning: str) -> bool:
    """Declare a switch that is set at the start.

    Args:
        node: The node.
        name: The parameter.
        default: Its default.
        meaning: What it does.

    Raises:
        SettingError: It was set to neither true nor false.
    """
    value = _declare(node, name, default, meaning)
    if not isinstance(value, bool):
        raise SettingError(f'{name} is {value!r}: it must be true or false')
    return value


def text(node: Node, name: str, default: str, meaning: str) -> str:
    """Declare a text that is set at the start.

    Args:
        node: The node.
        name: The parameter.
        default: Its default.
        meaning: What it is.

    Raises:
        SettingError: It was set to something else.
    """
    value = _declare(node, name, default, meaning)
    if not isinstance(value, str):
        raise SettingError(f'{name} is {value!r}: it must be a text')
    return value


def refuse_misspelt(node: Node) -> None:
    """Refuse a parameter that looks like one of the node's; rclpy would ignore it.

    Others are left alone: a parameter file may be for several nodes.

    Args:
        node: A node that has declared all its parameters.

    Raises:
        SettingError: There is one; the message says what was meant.
    """
    overrides = node._parameter_overrides  # noqa: SLF001  # there is no public way to ask
    unknown = [name for name in overrides if not node.has_parameter(name)]
    refuse_similar(unknown, node.get_parameters_by_prefix(''))


def refuse_similar(unknown: Iterable[str], known: Iterable[str]) -> None:
    """Refuse a name that looks like a known one.

    Args:
        unknown: Names that nobody knows.
        known: Names that there are.

    Raises:
        SettingError: There is one; the message says what was meant.
    """
    names = list(known)
    for name in sorted(unknown):
        close = difflib.get_close_matches(name, names, n=1, cutoff=0.75)
        if close:
            raise SettingError(f'unknown parameter {name!r}; did you mean {close[0]!r}?')


def _declare(node: Node, name: str, default: object, meaning: str) -> object:
    # dynamic, so that speed:=1 is a number too, and a wrong type gets our words
    descriptor = ParameterDescriptor(description=meaning, read_only=True, dynamic_typing=True)
    return node.declare_parameter(name, default, descriptor).value
