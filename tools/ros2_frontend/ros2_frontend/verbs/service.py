# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 service list`, `info`, `type` and `find`."""

from __future__ import annotations

from argparse import Namespace

from ..ros.graph import Graph, graph_verb
from .names import Names

SERVICES = Names('service', Graph.services)


@graph_verb(*SERVICES.list_arguments())
def list_names(graph: Graph, args: Namespace) -> None:
    """Print the services."""
    SERVICES.print_list(graph, args)


@graph_verb(SERVICES.name_argument('get info', '/add_two_ints'))
def info(graph: Graph, args: Namespace) -> None:
    """Print type and counts."""
    name = SERVICES.print_info_type(graph, args)
    print(f'Clients count: {graph.session.node.count_clients(name)}')
    print(f'Services count: {graph.session.node.count_services(name)}')


@graph_verb(SERVICES.name_argument('get type', '/talker/list_parameters'))
def type_of(graph: Graph, args: Namespace) -> int:
    """Print the types of a service."""
    return SERVICES.print_type(graph, args)


@graph_verb(
    SERVICES.type_argument('rcl_interfaces/srv/ListParameters'),
    *SERVICES.list_arguments(types=False),
)
def find(graph: Graph, args: Namespace) -> None:
    """Print the services that have a type."""
    SERVICES.print_found(graph, args)
