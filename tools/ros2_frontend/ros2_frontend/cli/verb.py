# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A verb of `ros2`, declared: its arguments, and the function that does it.

::

    @verb(argument('package_name', help='The package name'), flag('--share', help='...'))
    def prefix(args: Namespace) -> None: ...
"""

from __future__ import annotations

from argparse import ArgumentTypeError, Namespace
from collections.abc import Callable
from dataclasses import dataclass
import math
from typing import Any, TypeVar

Argument = Callable[[Any], object]
"""Adds one argument, or some that belong together, to a parser of argparse or a group of one."""

Main = Callable[[Namespace], 'int | None']
"""Does the verb; the exit code, of which None is 0. Raises FrontendError, for the user."""


N = TypeVar('N', int, float)


def argument(*names: str, **options: object) -> Argument:
    """Declare an argument as argparse does."""
    return lambda parser: parser.add_argument(*names, **options)


def flag(*names: str, **options: object) -> Argument:
    """Declare a switch."""
    return argument(*names, action='store_true', **options)


def exclusive(*arguments: Argument) -> Argument:
    """Allow at most one of several."""

    def add(parser: Any) -> None:  # noqa: ANN401  # as in argparse
        group = parser.add_mutually_exclusive_group()
        for each in arguments:
            each(group)

    return add


@dataclass(frozen=True, slots=True)
class Verb:
    """A verb of `ros2`: its arguments, in the order of the help page, and what does it."""

    arguments: tuple[Argument, ...]
    main: Main


def verb(*arguments: Argument) -> Callable[[Main], Verb]:
    """Make a verb of a function."""
    return lambda main: Verb(arguments, main)


def _number(
    kind: Callable[[str], N], what: str, accepts: Callable[[N], bool]
) -> Callable[[str], N]:
    def parse(text: str) -> N:
        try:
            value = kind(text)
        except ValueError:
            value = kind('-1')
        if not accepts(value):
            raise ArgumentTypeError(f'value must be {what}')
        return value

    return parse


unsigned_int = _number(int, 'non-negative integer', lambda value: value >= 0)
positive_int = _number(int, 'a positive integer', lambda value: value > 0)
positive_float = _number(float, 'a positive float', lambda value: 0.0 < value < math.inf)
unsigned_float = _number(float, 'a non-negative float', lambda value: 0.0 <= value < math.inf)

GRAPH_ARGUMENTS = (
    argument(
        '--spin-time',
        type=positive_float,
        metavar='SPIN_TIME',
        help='Time [s] to wait for discovery (default: 0.5, or 3.2 where DDS is open to others)',
    ),
    flag('-s', '--use-sim-time', help='Enable ROS simulation time'),
    flag('--no-daemon', help='Accepted and without effect: there is no daemon'),
)
"""The options of every verb that looks at the ROS graph."""


def content(name: str, help_: str, stdin_help: str) -> Argument:
    """Declare the values of a message, given as an argument or on standard input."""
    return exclusive(
        argument(name, nargs='?', default='{}', help=help_), flag('--stdin', help=stdin_help)
    )
