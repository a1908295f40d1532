# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Actions in the ROS graph."""

from __future__ import annotations

from collections.abc import Callable

from ..aliases import NamesAndTypes, Node
from .graph import Graph


def action_names(graph: Graph) -> NamesAndTypes:
    """The actions and their types, sorted by name.

    Args:
        graph: The graph.

    Returns:
        Name and types of each.
    """
    from rclpy.action.graph import get_action_names_and_types

    return sorted(get_action_names_and_types(graph.session.node))


def offered_actions(graph: Graph) -> set[str]:
    """The actions that some node offers; `action_names` names those that are only used, too.

    Args:
        graph: The graph with the nodes.

    Returns:
        Their names.
    """
    return {name for name, _ in action_names(graph) if clients_and_servers(graph, name)[1]}


def clients_and_servers(graph: Graph, action: str) -> tuple[NamesAndTypes, NamesAndTypes]:
    """The nodes that use and that offer an action.

    Args:
        graph: The graph with the nodes.
        action: The action's absolute name.

    Returns:
        Names of the nodes with the types they use the action with: clients, then servers.
    """
    from rclpy.action.graph import (
        get_action_client_names_and_types_by_node,
        get_action_server_names_and_types_by_node,
    )

    return (
        _nodes_with(get_action_client_names_and_types_by_node, graph, action),
        _nodes_with(get_action_server_names_and_types_by_node, graph, action),
    )


def _nodes_with(
    query: Callable[[Node, str, str], NamesAndTypes], graph: Graph, action: str
) -> NamesAndTypes:
    from rclpy.node import NodeNameNonExistentError

    found: NamesAndTypes = []
    for node in sorted(graph.nodes(hidden=True)):
        try:
            types = dict(query(graph.session.node, node.name, node.namespace)).get(action)
        except NodeNameNonExistentError:  # it left meanwhile
            continue
        if types:
            found.append((node.full_name, types))
    return found
