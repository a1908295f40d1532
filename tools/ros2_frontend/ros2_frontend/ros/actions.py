# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Actions in the ROS graph."""

from __future__ import annotations

from collections.abc import Callable

from ..aliases import Handle, NamesAndTypes
from .graph import Graph


def action_names(graph: Graph) -> NamesAndTypes:
    """Return the actions and their types, sorted by name."""
    from rclpy.action.graph import get_action_names_and_types

    return sorted(get_action_names_and_types(graph.session.node))


def offered_actions(graph: Graph) -> set[str]:
    """Return the actions that have a server; `action_names` has those with clients alone, too."""
    return {name for name, _ in action_names(graph) if clients_and_servers(graph, name)[1]}


def clients_and_servers(graph: Graph, action: str) -> tuple[NamesAndTypes, NamesAndTypes]:
    """Return the nodes that use and that offer an action, with the types they use it with."""
    from rclpy.action.graph import (
        get_action_client_names_and_types_by_node,
        get_action_server_names_and_types_by_node,
    )

    return (
        _nodes_with(get_action_client_names_and_types_by_node, graph, action),
        _nodes_with(get_action_server_names_and_types_by_node, graph, action),
    )


def _nodes_with(
    query: Callable[[Handle, str, str], NamesAndTypes], graph: Graph, action: str
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
