# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The node that a `param` or `lifecycle` command is about."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable

from ..cli.errors import UnknownNameError
from ..cli.suggest import hint
from ..cli.verb import Argument, argument, flag, Verb
from ..ros.graph import Graph, graph_verb
from ..ros.names import NodeName
from ..ros.session import Session

_NOT_FOUND = 'Node not found'


HIDDEN_NODES = flag('--include-hidden-nodes', help='Consider hidden nodes as well')
NODE = (argument('node_name', help='Name of the ROS node'), HIDDEN_NODES)
OPTIONAL_NODE = (argument('node_name', nargs='?', help='Name of the ROS node'), HIDDEN_NODES)
"""Without a name, all nodes are meant."""

NodeMain = Callable[[Session, NodeName, Namespace], 'int | None']


def node_verb(*arguments: Argument) -> Callable[[NodeMain], Verb]:
    """Make a verb of a function that talks to one node.

    Args:
        *arguments: Its arguments behind the node's name.
    """

    def declare(run: NodeMain) -> Verb:
        @graph_verb(*NODE, *arguments)
        def on_node(graph: Graph, args: Namespace) -> int | None:
            node = find_node(args.node_name, graph, args.include_hidden_nodes)
            return run(graph.session, node, args)

        return on_node

    return declare


def find_node(name: str, graph: Graph, hidden: bool, message: str = _NOT_FOUND) -> NodeName:
    """Wait for a node.

    Args:
        name: Its name as typed.
        graph: The graph to look into.
        hidden: Whether hidden nodes count.
        message: Message of ros2cli when it is not there.

    Returns:
        Its full name.

    Raises:
        UnknownNameError: When it does not appear; it names the nearest.
    """
    wanted = NodeName.parse(name)
    if not graph.wait_for(lambda: wanted in graph.nodes(hidden) or None):
        known = [node.full_name for node in graph.nodes(hidden=hidden or wanted.hidden)]
        raise UnknownNameError(message + hint(wanted.full_name, known))
    return wanted
