# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A verb of `ros2`, declared: its arguments, and the function that does it.

::

    @verb(argument('package_name', help='The package name'), flag('--share', help='...'))
    def prefix(args: Namespace) -> None: ...
"""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

Argument = Callable[[Any], object]
"""Adds one argument, or some that belong together, to a parser of argparse or a group of one."""

Main = Callable[[Namespace], 'int | None']
"""Does the verb; the exit code, of which None is 0. Raises FrontendError, for the user."""


def argument(*names: str, **options: object) -> Argument:
    """Declare an argument as argparse does."""
    return lambda parser: parser.add_argument(*names, **options)


def flag(*names: str, **options: object) -> Argument:
    """Declare a switch."""
    return argument(*names, action='store_true', **options)


def exclusive(*arguments: Argument) -> Argument:
    """Let at most one of several be given."""

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
