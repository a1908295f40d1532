# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The node that a `param` or `lifecycle` command is about."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable

from ..cli.errors import UnknownNameError
from ..cli.suggest import hint
from ..cli.verb import Argument, argument, flag, Verb
from ..names import NodeName
from ..ros.graph import Graph, graph_verb

HIDDEN_NODES = flag('--include-hidden-nodes', help='Consider hidden nodes as well')
NODE = (argument('node_name', help='Name of the ROS node'), HIDDEN_NODES)
OPTIONAL_NODE = (argument('node_name', nargs='?', help='Name of the ROS node'), HIDDEN_NODES)
"""Without a name, all nodes are meant."""

NodeMain = Callable[[Graph, NodeName, Namespace], 'int | None']


def node_verb(*arguments: Argument) -> Callable[[NodeMain], Verb]:
    """Make a verb of a function that talks to one node; it gets the node's name, too."""

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
        UnknownNameError: With the message, when it does not appear; it names the nearest.
    """
    wanted = NodeName.parse(name)
    if not graph.wait_for(lambda: wanted in graph.nodes(hidden) or None):
        known = [node.full_name for node in graph.nodes(hidden=hidden or wanted.hidden)]
        raise UnknownNameError(message + hint(wanted.full_name, known))
    return wanted
