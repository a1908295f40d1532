# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The node that a `param` or `lifecycle` command is about."""

from __future__ import annotations

from argparse import ArgumentParser

from ..cli.arguments import add_graph_arguments
from ..cli.errors import UnknownNameError
from ..cli.suggest import hint
from ..ros.graph import Graph
from ..ros.names import NodeName

_NOT_FOUND = 'Node not found'


def add_node_argument(parser: ArgumentParser, *, optional: bool = False) -> None:
    """Add the node's name and the switch that lets it be a hidden one.

    Args:
        parser: The command's parser.
        optional: Whether all nodes are meant when none is named.
    """
    add_graph_arguments(parser)
    parser.add_argument('node_name', nargs='?' if optional else None, help='Name of the ROS node')
    parser.add_argument(
        '--include-hidden-nodes', action='store_true', help='Consider hidden nodes as well'
    )


def find_node(name: str, graph: Graph, hidden: bool, message: str = _NOT_FOUND) -> NodeName:
    """Wait for a node.

    Args:
        name: Its name as typed.
        graph: The graph to look into.
        hidden: Whether hidden nodes count.
        message: What ros2cli says when it is not there.

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
