# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What several verbs share: arguments, ROS arguments without ROS, and output to the terminal.

Results go to stdout, warnings to stderr. The grammar of ROS arguments is that of ``--ros-args`` up
to ``--`` or the end (ROS 2 design, "ROS command line arguments"). Parameters are read, everything
else that ROS knows is taken and means nothing.
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
    """The command line names something that does not exist; nothing was sent yet."""


class StrictParser(argparse.ArgumentParser):
    """Takes options by their whole names only, and so do its sub-parsers."""

    def __init__(self, **settings: Any) -> None:  # noqa: ANN401  # those of argparse
        super().__init__(**settings, allow_abbrev=False)


if TYPE_CHECKING:
    SubParsers: TypeAlias = argparse._SubParsersAction[StrictParser]  # noqa: SLF001
else:
    SubParsers = object


BITRATE_MIN, BITRATE_MAX = 10_000, 1_000_000  # [bit/s] CiA 301, table 1


def bitrate(text: str) -> int:
    """Read a bit rate in [bit/s]; ``k`` and ``M`` behind a number are thousands and millions."""
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
    """Add what names a bus."""
    parser.add_argument(
        '--can',
        metavar='BUS',
        help='can0, vcan0, udp_multicast:239.x.y.z, ... (default: parameter can_interface_name, '
        'else auto)',
    )


def add_bus_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what names a bus and its devices."""
    add_bus_argument(parser)
    parser.add_argument(
        '--bus-config',
        metavar='BUS.yml',
        help='names devices and objects (default: parameter bus_config)',
    )


def add_node_arguments(parser: argparse.ArgumentParser) -> None:
    """Add what names a device of a bus."""
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
    """Fill options that were not given from ROS parameters of the names that the nodes have."""
    if 'can' in options:
        options.can = options.can or parameters.get('can_interface_name') or 'auto'
    if 'bus_config' in options:
        options.bus_config = options.bus_config or parameters.get('bus_config')


RED, YELLOW, RESET = '\x1b[1;31m', '\x1b[33m', '\x1b[0m'


def print_line(text: str = '') -> None:
    """Write a line of the result."""
    sys.stdout.write(f'{text}\n')


def warn(text: str) -> None:
    """Write a line for a person, beside the result."""
    with suppress(BrokenPipeError):
        sys.stdout.flush()
        sys.stderr.write(f'canopen: {text}\n')
        sys.stderr.flush()


def print_problem(problem: Problem, kind: str, color: str) -> None:
    """Write a problem as compilers do, its remedy in the line below."""
    place = f'{problem.file}:{problem.line}' if problem.line else str(problem.file)
    key = f'{problem.key}: ' if problem.key else ''
    print_line(f'{place}: {painted(kind, color)}: {key}{problem.message}')
    if problem.remedy:
        print_line(f'    {problem.remedy}')


def painted(text: str, color: str) -> str:
    """Return a text in colour, when a person looks at it."""
    if not sys.stdout.isatty() or 'NO_COLOR' in os.environ:
        return text
    return f'{color}{text}{RESET}'


def print_table(head: Sequence[str], rows: Sequence[Sequence[str]], right: str = '') -> None:
    """Write a table; right names the columns that are flush right, separated by commas."""
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
    """Split a command line: what is not for ROS, and values of ``-p name:=value`` by name.

    Raises:
        ValueError: A parameter has no value, or an option nothing behind it.
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
                parameters[name.rpartition(':')[2]] = text  # without the node's name before it
    return own, parameters
