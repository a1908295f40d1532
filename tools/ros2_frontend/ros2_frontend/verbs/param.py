# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 param get`, `set` and `delete`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace
import sys

from ..aliases import Message
from ..cli.arguments import positive_float
from ..cli.errors import FrontendError
from ..cli.suggest import hint
from ..ros.graph import open_graph
from ..ros.names import NodeName
from ..ros.parameters import (
    get_values,
    LABELS,
    list_names,
    parameter,
    parse_value,
    set_values,
    value_of,
)
from ..ros.session import Session
from .node_argument import add_node_argument, find_node


class Get:
    """Get parameter."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_node_argument(parser)
        parser.add_argument('parameter_name', help='Name of the parameter')
        parser.add_argument('--hide-type', action='store_true', help='Hide the type information')
        _add_timeout(parser)

    def main(self, args: Namespace) -> None:
        """Print the value.

        Raises:
            UnknownNameError: When there is no such node.
            FrontendError: When the node has no such parameter.
        """
        with open_graph(args, args.timeout) as graph:
            node = find_node(args.node_name, graph, args.include_hidden_nodes)
            values = get_values(graph.session, node, [args.parameter_name])
            if not values:
                raise FrontendError('Parameter not set' + _near(graph.session, node, args))
        value = value_of(values[0], raw=True)
        if args.hide_type:
            print(value)
        else:
            print(LABELS[values[0].type], *([] if value is None else [value]))


class Set:
    """Set parameter."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_node_argument(parser)
        parser.add_argument('parameter_name', help='Name of the parameter')
        parser.add_argument('value', help='Value of the parameter')
        _add_timeout(parser)

    def main(self, args: Namespace) -> None:
        """Set the value; a refusal is told on stderr, with exit code 0 as in ros2cli.

        Raises:
            UnknownNameError: When there is no such node.
        """
        wanted = parameter(args.parameter_name, parse_value(args.value))
        with open_graph(args, args.timeout) as graph:
            node = find_node(args.node_name, graph, args.include_hidden_nodes)
            result = set_values(graph.session, node, [wanted])[0]
            near = '' if result.successful else _near(graph.session, node, args)
        _tell(result, 'Set parameter successful', 'Setting parameter failed', near)


class Delete:
    """Delete parameter."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_node_argument(parser)
        parser.add_argument('parameter_name', help='Name of the parameter')
        _add_timeout(parser)

    def main(self, args: Namespace) -> None:
        """Delete the parameter; a refusal is told on stderr, with exit code 0 as in ros2cli.

        Raises:
            UnknownNameError: When there is no such node.
        """
        with open_graph(args, args.timeout) as graph:
            node = find_node(args.node_name, graph, args.include_hidden_nodes)
            result = set_values(graph.session, node, [parameter(args.parameter_name, None)])[0]
            near = '' if result.successful else _near(graph.session, node, args)
        _tell(result, 'Deleted parameter successfully', 'Deleting parameter failed', near)


def _add_timeout(parser: ArgumentParser) -> None:
    parser.add_argument(
        '--timeout',
        metavar='N',
        type=positive_float,
        help='Wait for N seconds until node becomes available '
        '(default: until the graph is complete)',
    )


def _tell(result: Message, success: str, failure: str, near: str) -> None:
    text = success if result.successful else failure
    if result.reason:
        text += f': {result.reason}'
    print(text + near, file=sys.stdout if result.successful else sys.stderr)


def _near(session: Session, node: NodeName, args: Namespace) -> str:
    """A hint when the node has no parameter of the name."""
    names = list_names(session, node)
    return '' if args.parameter_name in names else hint(args.parameter_name, names)
