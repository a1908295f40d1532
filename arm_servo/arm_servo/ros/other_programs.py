# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Other programs that move the same arm: they cannot run together, and the log says so."""

from __future__ import annotations

from collections.abc import Sequence

from rclpy.node import Node

WATCH_PERIOD = 1.0  # time between two looks at the graph in [s]
OWN_SERVICE = 'pause'  # service that the trajectory controller of this package has, and no other


def watch_other_programs(nodes: Sequence[Node], outputs: Sequence[str] = ()) -> None:
    """Log an error for each program that moves the arm, too, when it appears."""
    known: set[str] = set()

    def look() -> None:
        conflicts = {*same_names(nodes)}.union(
            *(_around_output(nodes[0], output) for output in outputs)
        )
        for conflict in sorted(conflicts - known):
            nodes[0].get_logger().error(conflict)
        known.clear()
        known.update(conflicts)

    nodes[0].create_timer(WATCH_PERIOD, look)


def same_names(nodes: Sequence[Node]) -> list[str]:
    """Return what is wrong where another node has the name of one of these."""
    graph = [
        f'{namespace.rstrip("/")}/{name}'
        for name, namespace in nodes[0].get_node_names_and_namespaces()
    ]
    own = [node.get_fully_qualified_name() for node in nodes]
    return [
        f'another program has a node {name}, too: clients reach both, and both move the arm. End'
        ' one of them, or give one a namespace (-r __ns:=/NAME)'
        for name in own
        if graph.count(name) > own.count(name)
    ]


def _around_output(node: Node, output: str) -> list[str]:
    """Return what is wrong with others that publish set-points, or that receive them."""
    topic = node.resolve_topic_name(output)
    publishers = node.get_publishers_info_by_topic(topic)
    conflicts = []
    if len(publishers) > 1:
        names = sorted(
            {f'{info.node_namespace.rstrip("/")}/{info.node_name}' for info in publishers}
        )
        conflicts.append(
            f'{len(publishers)} publishers of set-points on {topic} ({", ".join(names)}): the arm'
            ' cannot follow both. End one of them'
        )
    services = {name for name, _ in node.get_service_names_and_types()}
    for info in node.get_subscriptions_info_by_topic(topic):
        receiver = f'{info.node_namespace.rstrip("/")}/{info.node_name}'
        if f'{receiver}/{OWN_SERVICE}' in services:
            conflicts.append(
                f'{receiver} takes the set-points on {topic}, and is a trajectory controller of'
                ' arm_servo: each of them would be a trajectory that comes to rest. Run'
                ' motion_node with backend:=topics in the place of both programs'
            )
    return conflicts
