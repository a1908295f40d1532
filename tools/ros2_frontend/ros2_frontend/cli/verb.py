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
from typing import Any, Protocol


class Arguments(Protocol):
    """A parser of argparse, or a group of one."""

    def add_argument(self, *names: str, **options: Any) -> Any:  # noqa: ANN401  # as in argparse
        """Declare an option or a positional, as argparse does."""


class Parser(Arguments, Protocol):
    """A parser of argparse."""

    def add_mutually_exclusive_group(self) -> Arguments:
        """Return a place for options of which one may be given."""


Argument = Callable[[Parser], object]
"""Adds one argument, or some that belong together, to a parser."""

Main = Callable[[Namespace], 'int | None']
"""Does the verb; the exit code, of which None is 0. Raises FrontendError, for the user."""


def argument(*names: str, **options: object) -> Argument:
    """Declare an argument.

    Args:
        *names: Its name, or its options.
        **options: As in argparse.
    """
    return lambda parser: parser.add_argument(*names, **options)


def flag(*names: str, **options: object) -> Argument:
    """Declare a switch.

    Args:
        *names: Its options.
        **options: As in argparse.
    """
    return argument(*names, action='store_true', **options)


def exclusive(*arguments: Callable[[Any], object]) -> Argument:
    """Let at most one of several be given.

    Args:
        *arguments: The arguments.
    """

    def add(parser: Parser) -> None:
        group = parser.add_mutually_exclusive_group()
        for each in arguments:
            each(group)

    return add


@dataclass(frozen=True, slots=True)
class Verb:
    """A verb of `ros2`.

    Attributes:
        arguments: Its arguments, in the order of the help page.
        main: Does it.
    """

    arguments: tuple[Argument, ...]
    main: Main

    def add_arguments(self, parser: Parser) -> None:
        """Add all arguments to a parser."""
        for each in self.arguments:
            each(parser)


def verb(*arguments: Argument) -> Callable[[Main], Verb]:
    """Make a verb of a function.

    Args:
        *arguments: Its arguments, in the order of the help page.
    """
    return lambda main: Verb(arguments, main)
