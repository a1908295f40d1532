# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Who publishes, subscribes and serves, for the panel that draws it."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass

from foxglove import ConnectionGraph
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.topic_endpoint_info import TopicEndpointInfo


@dataclass(frozen=True, slots=True)
class Links:
    """Names of nodes by topic and service.

    Attributes:
        published: By topic that they publish.
        subscribed: By topic that they subscribe to.
        served: By service.
    """

    published: dict[str, list[str]]
    subscribed: dict[str, list[str]]
    served: dict[str, list[str]]

    def graph(self) -> ConnectionGraph:
        """Return it as foxglove-sdk has it."""
        graph = ConnectionGraph()
        for topic, nodes in self.published.items():
            graph.set_published_topic(topic, nodes)
        for topic, nodes in self.subscribed.items():
            graph.set_subscribed_topic(topic, nodes)
        for service, nodes in self.served.items():
            graph.set_advertised_service(service, nodes)
        return graph


def links(node: Node, topics: Sequence[str]) -> Links:
    """Ask the graph.

    Args:
        node: Asks.
        topics: Names of the topics that are shown.
    """
    served = defaultdict[str, set[str]](set)
    for name, namespace in node.get_node_names_and_namespaces():
        with suppress(NodeNameNonExistentError):  # it has just gone
            for service, _ in node.get_service_names_and_types_by_node(name, namespace):
                served[service].add(f'{namespace.rstrip("/")}/{name}')
    return Links(
        _by_topic(node.get_publishers_info_by_topic, topics),
        _by_topic(node.get_subscriptions_info_by_topic, topics),
        {service: sorted(nodes) for service, nodes in served.items()},
    )


def _by_topic(
    ask: Callable[[str], list[TopicEndpointInfo]], topics: Sequence[str]
) -> dict[str, list[str]]:
    found = {
        topic: sorted({f'{end.node_namespace.rstrip("/")}/{end.node_name}' for end in ask(topic)})
        for topic in topics
    }
    return {topic: nodes for topic, nodes in found.items() if nodes}
