# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 node list` and `ros2 node info`."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Iterable
import sys

from ..aliases import NamesAndTypes, Node
from ..cli.verb import argument, flag
from ..ros.graph import Graph, graph_verb
from ..ros.names import is_hidden
from .node_argument import find_node

LIST_ARGUMENTS = (
    flag('-a', '--all', help='Display all nodes even hidden ones'),
    flag('-c', '--count-nodes', help='Only display the number of nodes discovered'),
)


@graph_verb(*LIST_ARGUMENTS)
def list_names(graph: Graph, args: Namespace) -> None:
    """Print the names, sorted."""
    graph.settle()
    names = sorted(node.full_name for node in graph.nodes(hidden=args.all))
    if args.count_nodes:
        print(len(names))
        return
    if len(set(names)) < len(names):
        print(
            'WARNING: Be aware that there are nodes in the graph that share an exact name, '
            'which can have unintended side effects.',
            file=sys.stderr,
        )
    for name in names:
        print(name)


@graph_verb(
    argument('node_name', help='Node name to request information about'),
    flag('--include-hidden', help='Display hidden topics, services, and actions as well'),
)
def info(graph: Graph, args: Namespace) -> None:
    """Print what the node offers and uses.

    Raises:
        UnknownNameError: When there is no such node.
    """
    unknown = f"Unable to find node '{args.node_name}'"
    wanted = find_node(args.node_name, graph, args.include_hidden, unknown)
    graph.settle()
    count = graph.nodes(hidden=True).count(wanted)
    if count > 1:
        print(
            f'There are {count} nodes in the graph with the exact name '
            f'"{wanted.full_name}". You are seeing information about only one of them.',
            file=sys.stderr,
        )
    print(wanted.full_name)
    for title, query in _queries():
        entries = query(graph.session.node, wanted.name, wanted.namespace)
        print(f'  {title}:')
        _print_entries(entries, args.include_hidden)


Query = Callable[[Node, str, str], NamesAndTypes]


def _queries() -> Iterable[tuple[str, Query]]:
    from rclpy.action.graph import (
        get_action_client_names_and_types_by_node,
        get_action_server_names_and_types_by_node,
    )
    from rclpy.node import Node as RclpyNode

    return (
        ('Subscribers', RclpyNode.get_subscriber_names_and_types_by_node),
        ('Publishers', RclpyNode.get_publisher_names_and_types_by_node),
        ('Service Servers', RclpyNode.get_service_names_and_types_by_node),
        ('Service Clients', RclpyNode.get_client_names_and_types_by_node),
        ('Action Servers', get_action_server_names_and_types_by_node),
        ('Action Clients', get_action_client_names_and_types_by_node),
    )


def _print_entries(entries: NamesAndTypes, include_hidden: bool) -> None:
    shown = [(name, types) for name, types in entries if include_hidden or not is_hidden(name)]
    # an empty block is one empty line
    print(*(f'    {name}: {", ".join(types)}' for name, types in shown), sep='\n')
