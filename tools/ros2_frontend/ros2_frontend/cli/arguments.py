# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Argument types and options that several commands share."""

from __future__ import annotations

from argparse import ArgumentTypeError

from .verb import Argument, argument, exclusive, flag


def unsigned_int(text: str) -> int:
    """An integer of zero or more.

    Args:
        text: The argument as typed.

    Returns:
        Its value.

    Raises:
        ArgumentTypeError: When it is negative or no integer.
    """
    if not text.isdecimal():
        raise ArgumentTypeError('value must be non-negative integer')
    return int(text)


def positive_int(text: str) -> int:
    """An integer of one or more.

    Args:
        text: The argument as typed.

    Returns:
        Its value.

    Raises:
        ArgumentTypeError: When it is zero, negative or no integer.
    """
    if not text.isdecimal() or not int(text):
        raise ArgumentTypeError('value must be a positive integer')
    return int(text)


def positive_float(text: str) -> float:
    """A finite number above zero.

    Args:
        text: The argument as typed.

    Returns:
        Its value.

    Raises:
        ArgumentTypeError: When it is zero, negative, infinite or no number.
    """
    try:
        value = float(text)
    except ValueError:
        value = -1.0
    if not 0.0 < value < float('inf'):
        raise ArgumentTypeError('value must be a positive float')
    return value


GRAPH_ARGUMENTS = (
    argument(
        '--spin-time',
        type=positive_float,
        metavar='SPIN_TIME',
        help='Longest time [s] to wait for discovery (default: until the graph is complete)',
    ),
    flag('-s', '--use-sim-time', help='Enable ROS simulation time'),
    flag('--no-daemon', help='Accepted and without effect: there is no daemon'),
)
"""The options of every verb that looks at the ROS graph."""


def content(name: str, help_: str, stdin_help: str) -> Argument:
    """Declare the values of a message, given as an argument or on standard input.

    Args:
        name: Name of the argument.
        help_: Its help.
        stdin_help: Help of `--stdin`.
    """
    return exclusive(
        argument(name, nargs='?', default='{}', help=help_), flag('--stdin', help=stdin_help)
    )
