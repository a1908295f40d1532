# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""`ros2 node list` and `info`, and the lookup of nodes for `param` and `lifecycle`."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable
import sys

from ..cli.commands import Argument, argument, flag, hint, UnknownNameError, Verb
from ..names import is_hidden, NodeName
from ..ros.graph import Graph, graph_verb

HIDDEN_NODES = flag('--include-hidden-nodes', help='Consider hidden nodes as well')
NODE = (argument('node_name', help='Name of the ROS node'), HIDDEN_NODES)
OPTIONAL_NODE = (argument('node_name', nargs='?', help='Name of the ROS node'), HIDDEN_NODES)
"""Without a name, the command applies to all nodes."""

NodeMain = Callable[[Graph, NodeName, Namespace], 'int | None']

LIST_ARGUMENTS = (
    flag('-a', '--all', help='Display all nodes even hidden ones'),
    flag('-c', '--count-nodes', help='Only display the number of nodes discovered'),
)


def node_verb(*arguments: Argument) -> Callable[[NodeMain], Verb]:
    """Decorate a function for one node as a verb; it also gets the node's name."""

    def declare(run: NodeMain) -> Verb:
        @graph_verb(*NODE, *arguments)
        def on_node(graph: Graph, args: Namespace) -> int | None:
            node = find_node(args.node_name, graph, args.include_hidden_nodes)
            return run(graph, node, args)

        return on_node

    return declare


def find_node(name: str, graph: Graph, hidden: bool, message: str = 'Node not found') -> NodeName:
    """Wait for a node, by its name as typed.

    Raises:
        UnknownNameError: The node does not appear; the error is `message` with the nearest name.
    """
    wanted = NodeName.parse(name)
    if not graph.wait_for(lambda: wanted in graph.nodes(hidden) or None):
        known = [node.full_name for node in graph.nodes(hidden=hidden or wanted.hidden)]
        raise UnknownNameError(message + hint(wanted.full_name, known))
    return wanted


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
    """Print the topics, services and actions of the node."""
    from rclpy.action.graph import (
        get_action_client_names_and_types_by_node,
        get_action_server_names_and_types_by_node,
    )
    from rclpy.node import Node

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
    for title, query in (
        ('Subscribers', Node.get_subscriber_names_and_types_by_node),
        ('Publishers', Node.get_publisher_names_and_types_by_node),
        ('Service Servers', Node.get_service_names_and_types_by_node),
        ('Service Clients', Node.get_client_names_and_types_by_node),
        ('Action Servers', get_action_server_names_and_types_by_node),
        ('Action Clients', get_action_client_names_and_types_by_node),
    ):
        entries = query(graph.session.node, wanted.name, wanted.namespace)
        lines = [
            f'    {name}: {", ".join(types)}'
            for name, types in entries
            if args.include_hidden or not is_hidden(name)
        ]
        print(f'  {title}:')
        print(*lines, sep='\n')  # an empty block is one empty line
