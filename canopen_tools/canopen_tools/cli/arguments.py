# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Code shared by several verbs: arguments, ROS arguments without ROS, and terminal output.

Results go to stdout, warnings to stderr. ROS arguments are those from ``--ros-args`` to ``--`` or
the end (ROS 2 design, "ROS command line arguments"). Parameters are read; all other ROS arguments
are accepted and ignored.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from contextlib import suppress
import os
import sys
from typing import Any, TYPE_CHECKING, TypeAlias

from canopen_core import CanopenError, Problem
from canopen_core.standard import NODE_ID_MAX, NODE_ID_MIN


class UsageError(CanopenError):
    """The command line is invalid; nothing has been sent."""


class StrictParser(argparse.ArgumentParser):
    """Accepts unabbreviated options only, also in its sub-parsers."""

    def __init__(self, **settings: Any) -> None:  # noqa: ANN401  # settings of argparse
        super().__init__(**settings, allow_abbrev=False)


if TYPE_CHECKING:
    SubParsers: TypeAlias = argparse._SubParsersAction[StrictParser]  # noqa: SLF001
else:
    SubParsers = object


BITRATE_MIN, BITRATE_MAX = 10_000, 1_000_000  # [bit/s] CiA 301, table 1


def bitrate(text: str) -> int:
    """Read a bit rate in [bit/s]; suffixes ``k`` and ``M`` mean thousands and millions."""
    factors = {'k': 1000, 'M': 1_000_000}
    factor = factors.get(text[-1:], 1)
    digits = text[:-1] if factor > 1 else text
    if not digits.isdecimal():
        raise argparse.ArgumentTypeError(f'{text!r} is no bit rate; write 500000 or 500k')
    number = int(digits) * factor
    if not BITRATE_MIN <= number <= BITRATE_MAX:
        hint = f'; {text}k perhaps' if factor == 1 and 10 <= number <= 1000 else ''
        raise argparse.ArgumentTypeError(f'{text} bit/s is not 10k to 1M{hint}')
    return number


def node_id(text: str) -> int:
    """Read a node id, decimal or hexadecimal with ``0x``."""
    try:
        number = int(text, 0)
    except ValueError:
        raise argparse.ArgumentTypeError(f'{text!r} is no whole number') from None
    if not NODE_ID_MIN <= number <= NODE_ID_MAX:
        raise argparse.ArgumentTypeError(f'{text} is no node id; take 1 to 127')
    return number


def seconds(text: str) -> float:
    """Read a time in [s]."""
    try:
        number = float(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f'{text!r} is no time in s') from None
    if not 0.0 < number <= 3600.0:
        raise argparse.ArgumentTypeError(f'{text} s is not above 0 and up to an hour')
    return number


def add_bus_argument(parser: argparse.ArgumentParser) -> None:
    """Add the argument that selects a bus."""
    parser.add_argument(
        '--can',
        metavar='BUS',
        help='can0, vcan0, udp_multicast:239.x.y.z, ... (default: parameter can_interface_name, '
        'else auto)',
    )


def add_bus_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that select a bus and its bus.yml."""
    add_bus_argument(parser)
    parser.add_argument(
        '--bus-config',
        metavar='BUS.yml',
        help='names devices and objects (default: parameter bus_config)',
    )


def add_node_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments that select a device."""
    parser.add_argument(
        'node', metavar='NODE', help='node id, or name of a device of --bus-config'
    )
    add_bus_arguments(parser)
    parser.add_argument(
        '--eds', metavar='FILE', help='EDS of the device, when there is no bus.yml'
    )
    parser.add_argument(
        '--timeout',
        type=seconds,
        metavar='S',
        help='longest time for an answer in s (default: sdo_timeout_ms of bus.yml, else 0.5)',
    )


def apply_parameters(options: argparse.Namespace, parameters: Mapping[str, str]) -> None:
    """Fill missing options from ROS parameters, under the names that our nodes use."""
    if 'can' in options:
        options.can = options.can or parameters.get('can_interface_name') or 'auto'
    if 'bus_config' in options:
        options.bus_config = options.bus_config or parameters.get('bus_config')


RED, YELLOW, RESET = '\x1b[1;31m', '\x1b[33m', '\x1b[0m'


def print_line(text: str = '') -> None:
    """Write a line of the result."""
    sys.stdout.write(f'{text}\n')


def warn(text: str) -> None:
    """Write a line for the user to stderr."""
    with suppress(BrokenPipeError):
        sys.stdout.flush()
        sys.stderr.write(f'canopen: {text}\n')
        sys.stderr.flush()


def print_problem(problem: Problem, kind: str, color: str) -> None:
    """Write a problem in compiler style, its remedy on the next line."""
    place = f'{problem.file}:{problem.line}' if problem.line else str(problem.file)
    key = f'{problem.key}: ' if problem.key else ''
    print_line(f'{place}: {painted(kind, color)}: {key}{problem.message}')
    if problem.remedy:
        print_line(f'    {problem.remedy}')


def painted(text: str, color: str) -> str:
    """Return a text, coloured on a terminal."""
    if not sys.stdout.isatty() or 'NO_COLOR' in os.environ:
        return text
    return f'{color}{text}{RESET}'


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]], right: str = '') -> None:
    """Write a table; right lists the right-aligned columns, separated by commas."""
    flush_right = set(right.split(','))
    widths = [max(map(len, column)) for column in zip(head, *rows, strict=True)]
    for row in (head, *rows):
        cells = (
            cell.rjust(width) if title in flush_right else cell.ljust(width)
            for cell, width, title in zip(row, widths, head, strict=True)
        )
        print_line('  '.join(cells).rstrip())


def counted(number: int, noun: str) -> str:
    """Return a number with its noun: ``1 error``, ``2 errors``."""
    return f'{number} {noun}' if number == 1 else f'{number} {noun}s'


_PARAMETER = frozenset({'-p', '--param'})
_WITH_VALUE = frozenset(
    {'-r', '--remap', '--params-file', '-e', '--enclave', '--log-level', '--log-config-file'}
)


def split_ros_arguments(argv: Sequence[str]) -> tuple[list[str], dict[str, str]]:
    """Split a command line into non-ROS arguments and ``-p name:=value`` parameters by name.

    Raises:
        ValueError: A parameter has no value, or an option no argument.
    """
    own: list[str] = []
    parameters: dict[str, str] = {}
    words, in_ros = iter(argv), False
    for word in words:
        if word == '--ros-args' or (in_ros and word == '--'):
            in_ros = word == '--ros-args'
        elif not in_ros:
            own.append(word)
        elif word in _PARAMETER | _WITH_VALUE:
            value = next(words, None)
            if value is None:
                raise ValueError(f'{word} needs a value')
            name, assigned, text = value.partition(':=')
            if word in _PARAMETER and not (name and assigned):
                raise ValueError(f'{value!r} is not a parameter; write name:=value')
            if word in _PARAMETER:
                parameters[name.rpartition(':')[2]] = text  # without the node name
    return own, parameters
