# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Argument types and options that several commands share."""

from __future__ import annotations

from argparse import ArgumentTypeError
from collections.abc import Callable
import math
from typing import TypeVar

from .verb import Argument, argument, exclusive, flag

N = TypeVar('N', int, float)


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
