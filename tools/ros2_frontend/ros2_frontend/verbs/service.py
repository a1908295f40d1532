# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 service list`, `info`, `type` and `find`."""

from __future__ import annotations

from argparse import ArgumentParser, Namespace

from ..cli.arguments import add_graph_arguments
from ..ros.graph import open_graph
from ..ros.names import absolute
from .names import (
    add_find_arguments,
    add_hidden_flag,
    add_list_arguments,
    print_found,
    print_names,
    print_types,
    types_of,
)

_NOUN = 'services'


class List:
    """Output a list of available services."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_list_arguments(parser, _NOUN)
        add_hidden_flag(parser, _NOUN)

    def main(self, args: Namespace) -> None:
        """Print the services."""
        with open_graph(args) as graph:
            graph.settle()
            services = graph.services(args.include_hidden_services)
        print_names(services, args)


class Info:
    """Print information about a service."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_graph_arguments(parser)
        parser.add_argument(
            'service_name', help="Name of the ROS service to get info (e.g. '/add_two_ints')"
        )

    def main(self, args: Namespace) -> None:
        """Print type and counts.

        Raises:
            UnknownNameError: When there is no such service.
        """
        name = absolute(args.service_name)
        with open_graph(args) as graph:
            unknown = f"Unknown service '{args.service_name}'"
            types = types_of(name, graph, graph.services, unknown)
            graph.settle()
            clients, servers = (
                graph.session.node.count_clients(name),
                graph.session.node.count_services(name),
            )
        print(f'Type: {types[0] if len(types) == 1 else types}')
        print(f'Clients count: {clients}')
        print(f'Services count: {servers}')


class Type:
    """Output a service's type."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_graph_arguments(parser)
        parser.add_argument(
            'service_name',
            help="Name of the ROS service to get type (e.g. '/talker/list_parameters')",
        )

    def main(self, args: Namespace) -> int:
        """Print the types.

        Returns:
            The exit code: 1 when there is no such service.
        """
        with open_graph(args) as graph:
            hidden = args.include_hidden_services
            return print_types(args.service_name, graph, graph.services, hidden)


class Find:
    """Output a list of available services of a given type."""

    def add_arguments(self, parser: ArgumentParser) -> None:
        """Add the command's own arguments."""
        add_find_arguments(parser, _NOUN, 'rcl_interfaces/srv/ListParameters')
        add_hidden_flag(parser, _NOUN)

    def main(self, args: Namespace) -> None:
        """Print the services that have the type."""
        with open_graph(args) as graph:
            graph.settle()
            services = graph.services(args.include_hidden_services)
        print_found(services, args.service_type, args.count)
