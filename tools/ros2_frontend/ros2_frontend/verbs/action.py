# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 action list`, `info` and `type`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..aliases import NamesAndTypes
from ..cli.arguments import add_graph_arguments
from ..ros.actions import action_names, clients_and_servers
from ..ros.graph import open_graph
from ..ros.names import absolute
from .names import add_list_arguments, print_names, print_types


class List:
    """Output a list of action names."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_list_arguments(parser, 'actions')

    def main(self, args: Namespace) -> None:
        """Print the actions."""
        with open_graph(args) as graph:
            graph.settle()
            actions = action_names(graph)
        print_names(actions, args)


class Info:
    """Print information about an action."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_graph_arguments(parser)
        parser.add_argument(
            'action_name', help="Name of the ROS action to get info (e.g. '/fibonacci')"
        )
        parser.add_argument(
            '-t', '--show-types', action='store_true', help='Additionally show the action type'
        )
        parser.add_argument(
            '-c',
            '--count',
            action='store_true',
            help='Only display the number of action clients and action servers',
        )

    def main(self, args: Namespace) -> None:
        """Print who offers and who uses the action; nobody is no error, as in ros2cli."""
        name = absolute(args.action_name)
        with open_graph(args) as graph:
            graph.wait_for(lambda: dict(action_names(graph)).get(name))
            graph.settle()
            clients, servers = clients_and_servers(graph, name)
        print(f'Action: {args.action_name}')
        for title, nodes in (('clients', clients), ('servers', servers)):
            print(f'Action {title}: {len(nodes)}')
            if not args.count:
                _print_nodes(nodes, args.show_types)


def _print_nodes(nodes: NamesAndTypes, show_types: bool) -> None:
    for name, types in nodes:
        print(f'    {name} [{", ".join(types)}]' if show_types else f'    {name}')


class Type:
    """Print a action's type."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_graph_arguments(parser)
        parser.add_argument(
            'action_name', help="Name of the ROS action to get type (e.g. '/fibonacci')"
        )

    def main(self, args: Namespace) -> int:
        """Print the types.

        Returns:
            The exit code: 1 when there is no such action.
        """
        with open_graph(args) as graph:
            return print_types(args.action_name, graph, lambda _: action_names(graph), True)
