# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 param list` and `describe`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
from collections.abc import Sequence
import re
import sys

from ..aliases import Message
from ..cli.errors import FrontendError, NoAnswerError
from ..ros.graph import Graph, open_graph
from ..ros.names import NodeName
from ..ros.parameters import describe, list_names, TYPE_NAMES
from ..ros.session import Session
from .node_argument import add_node_argument, find_node


class List:
    """Output a list of available parameters."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_node_argument(parser, optional=True)
        parser.add_argument(
            '--filter',
            help='Only parameters matching the regex expression will be showed. '
            'Supports `re` regex syntax.',
        )
        parser.add_argument(
            '--param-prefixes',
            nargs='+',
            default=[],
            help='Only list parameters with the provided prefixes',
        )
        parser.add_argument(
            '--param-type', action='store_true', help='Print parameter types with parameter names'
        )

    def main(self, args: Namespace) -> None:
        """Print the names, below their node's when all nodes are asked.

        Raises:
            UnknownNameError: When there is no such node.
            FrontendError: When the filter is no regular expression.
        """
        pattern = _compile(args.filter)
        with open_graph(args) as graph:
            for node in _nodes(args, graph):
                try:
                    names = list_names(graph.session, node, args.param_prefixes)
                except NoAnswerError as error:
                    print(error, file=sys.stderr)
                    continue
                names = [name for name in names if pattern.match(name)]
                if names and not args.node_name:
                    print(f'{node.full_name}:')
                _print_names(graph.session, node, names, args.param_type)


def _compile(text: str | None) -> re.Pattern[str]:
    try:
        return re.compile(text or '')
    except re.error as error:
        raise FrontendError(f"Invalid --filter '{text}': {error}") from None


def _nodes(args: Namespace, graph: Graph) -> Sequence[NodeName]:
    """The named node, or all that offer the service."""
    if args.node_name:
        return [find_node(args.node_name, graph, args.include_hidden_nodes)]
    graph.settle()
    services = dict(graph.services(hidden=True))
    nodes = sorted(set(graph.nodes(args.include_hidden_nodes)))
    return [node for node in nodes if f'{node.full_name}/list_parameters' in services]


def _print_names(session: Session, node: NodeName, names: Sequence[str], with_type: bool) -> None:
    if not with_type:
        for name in names:
            print(f'  {name}')
        return
    for descriptor in describe(session, node, names):
        print(f'  {descriptor.name} (type: {TYPE_NAMES[descriptor.type]})')


class Describe:
    """Show descriptive information about declared parameters."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_node_argument(parser)
        parser.add_argument('parameter_names', nargs='+', help='Names of the parameters')

    def main(self, args: Namespace) -> None:
        """Print what the node tells of the parameters.

        Raises:
            UnknownNameError: When there is no such node.
        """
        with open_graph(args) as graph:
            node = find_node(args.node_name, graph, args.include_hidden_nodes)
            descriptors = describe(graph.session, node, args.parameter_names)
        for descriptor in descriptors:
            _print_descriptor(descriptor)


def _print_descriptor(descriptor: Message) -> None:
    print('Parameter name:', descriptor.name)
    print('  Type:', TYPE_NAMES[descriptor.type])
    if descriptor.description:
        print('  Description:', descriptor.description)
    print('  Constraints:')
    if descriptor.read_only:
        print('    Read only: true')
    for range_ in [*descriptor.floating_point_range, *descriptor.integer_range][:1]:
        print('    Min value:', range_.from_value)
        print('    Max value:', range_.to_value)
        if range_.step:
            print('    Step:', range_.step)
    if descriptor.additional_constraints:
        print('    Additional constraints:', descriptor.additional_constraints)
