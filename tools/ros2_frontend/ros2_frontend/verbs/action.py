# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 action list`, `info` and `type`."""

from __future__ import annotations

from argparse import Namespace

from ..cli.commands import flag
from ..names import absolute
from ..ros.graph import action_names, clients_and_servers, Graph, graph_verb
from .names import Names

ACTIONS = Names('action', lambda graph, _: action_names(graph))


@graph_verb(*ACTIONS.list_arguments(hidden=False))
def list_names(graph: Graph, args: Namespace) -> None:
    """Print the actions."""
    ACTIONS.print_list(graph, args)


@graph_verb(
    ACTIONS.name_argument('get info', '/fibonacci'),
    ACTIONS.types_flag(),
    flag('-c', '--count', help='Only display the number of action clients and action servers'),
)
def info(graph: Graph, args: Namespace) -> None:
    """Print the clients and servers of the action; none is no error, as in ros2cli."""
    name = absolute(args.action_name)
    graph.wait_for(lambda: dict(action_names(graph)).get(name))
    graph.settle()
    clients, servers = clients_and_servers(graph, name)
    print(f'Action: {args.action_name}')
    for title, nodes in (('clients', clients), ('servers', servers)):
        print(f'Action {title}: {len(nodes)}')
        for node, types in () if args.count else nodes:
            print(f'    {node} [{", ".join(types)}]' if args.show_types else f'    {node}')


@graph_verb(ACTIONS.name_argument('get type', '/fibonacci'))
def type_of(graph: Graph, args: Namespace) -> int:
    """Print the types of an action."""
    return ACTIONS.print_type(graph, args)
