# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Nodes of others that publish what a program is about to publish, too."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import threading
import time

from rclpy.node import Node

DISCOVERY_TIME = 2.0  # [s] in which nodes that run are discovered
_LOOK_PERIOD = 0.1  # [s]


def other_nodes(node: Node, names: Iterable[str], own: Sequence[str]) -> list[str]:
    """Return the nodes of some names that others run."""
    graph = [
        f'{namespace.rstrip("/")}/{name}'
        for name, namespace in node.get_node_names_and_namespaces()
    ]
    return sorted(name for name in set(names) if graph.count(name) > own.count(name))


def discover_other_nodes(
    node: Node, names: Iterable[str], own: Sequence[str], stop: threading.Event
) -> list[str]:
    """Wait for as long as discovery takes; return what is found as soon as there is any.

    Args:
        node: As of :func:`other_nodes`.
        names: As of :func:`other_nodes`.
        own: As of :func:`other_nodes`.
        stop: Ends it.
    """
    wanted, deadline = set(names), time.monotonic() + DISCOVERY_TIME
    while time.monotonic() < deadline and not stop.wait(_LOOK_PERIOD):
        if found := other_nodes(node, wanted, own):
            return found
    return []
