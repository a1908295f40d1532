# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What listing, typing and finding have in common for topics, services and actions."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace, SUPPRESS
from collections.abc import Callable
import sys

from ..aliases import NamesAndTypes
from ..cli.arguments import add_graph_arguments
from ..cli.errors import UnknownNameError
from ..cli.suggest import hint
from ..ros.graph import Graph
from ..ros.names import absolute, is_hidden

Read = Callable[[bool], NamesAndTypes]
"""Gives names and types; the argument says whether to include hidden ones."""


def add_hidden_flag(parser: ArgumentParser, noun: str) -> None:
    """Add the switch that shows hidden names.

    Args:
        parser: The command's parser.
        noun: What is listed: topics or services.
    """
    parser.add_argument(
        f'--include-hidden-{noun}',
        dest=f'include_hidden_{noun}',
        action='store_true',
        default=SUPPRESS,  # the group has the same switch before its verb
        help=f'Consider hidden {noun} as well',
    )


def add_list_arguments(parser: ArgumentParser, noun: str) -> None:
    """Add the arguments of a `list` verb.

    Args:
        parser: The command's parser.
        noun: What is listed: topics, services or actions.
    """
    add_graph_arguments(parser)
    parser.add_argument(
        '-t',
        '--show-types',
        action='store_true',
        help=f'Additionally show the {noun.removesuffix("s")} type',
    )
    _add_count(parser, noun)


def add_find_arguments(parser: ArgumentParser, noun: str, example: str) -> None:
    """Add the arguments of a `find` verb.

    Args:
        parser: The command's parser.
        noun: What is listed: topics or services.
        example: A type, for the help text.
    """
    add_graph_arguments(parser)
    kind = noun.removesuffix('s')
    parser.add_argument(
        f'{kind}_type',
        metavar=f'{kind}_type',
        help=f"Name of the ROS {kind} type to filter for (e.g. '{example}')",
    )
    _add_count(parser, noun)


def _add_count(parser: ArgumentParser, noun: str) -> None:
    parser.add_argument(
        '-c',
        f'--count-{noun}',
        dest='count',
        action='store_true',
        help=f'Only display the number of {noun} discovered',
    )


def print_names(pairs: NamesAndTypes, args: Namespace) -> None:
    """Print what a `list` verb found.

    Args:
        pairs: Names and types.
        args: The parsed arguments of `add_list_arguments`.
    """
    if args.count:
        print(len(pairs))
        return
    for name, types in pairs:
        print(f'{name} [{", ".join(types)}]' if args.show_types else name)


def print_found(pairs: NamesAndTypes, wanted: str, count: bool) -> None:
    """Print the names that have a type.

    Args:
        pairs: Names and types.
        wanted: The type.
        count: Whether to print only how many there are.
    """
    found = [name for name, types in pairs if wanted in types]
    if count:
        print(len(found))
        return
    for name in found:
        print(name)


def types_of(name: str, graph: Graph, read: Read, message: str) -> list[str]:
    """Wait for a name and answer its types.

    Args:
        name: The name as typed; a missing leading slash is added.
        graph: The graph to wait in.
        read: Gives the names that count.
        message: What ros2cli says when it is not there.

    Returns:
        Its types.

    Raises:
        UnknownNameError: When it does not appear; it names the nearest.
    """
    full_name = absolute(name)
    types = graph.wait_for(lambda: dict(read(True)).get(full_name))
    if types is None:
        known = [other for other, _ in read(is_hidden(full_name))]
        raise UnknownNameError(message + hint(full_name, known))
    return types


def print_types(name: str, graph: Graph, read: Read, hidden: bool) -> int:
    """Print the types of a name, one per line.

    Args:
        name: The name as typed.
        graph: The graph to wait in.
        read: Gives the names that count.
        hidden: Whether hidden names count.

    Returns:
        The exit code: 1, and nothing on stdout, when there is no such name (as ros2cli does).
    """
    try:
        types = types_of(name, graph, lambda _: read(hidden), f"Unknown name '{name}'")
    except UnknownNameError as error:
        print(error, file=sys.stderr)
        return 1
    for type_ in types:
        print(type_)
    return 0
