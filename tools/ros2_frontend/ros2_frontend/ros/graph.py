# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS graph as one node sees it."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from typing import TypeVar

from ..aliases import Endpoint, NamesAndTypes
from .discovery import Patience, wait
from .names import is_hidden, NodeName
from .session import Session

T = TypeVar('T')


class Graph:
    """What is in the ROS graph, and waiting for it.

    Attributes:
        domain_id: The ROS domain.
    """

    def __init__(self, session: Session, spin_time: float | None = None) -> None:
        """Look at the graph through a session.

        Args:
            session: The session; its node is part of the graph.
            spin_time: Longest time [s] to wait for discovery; None decides by the graph.
        """
        self._node = session.node
        self._spin_time = spin_time
        self.domain_id: int = session.node.context.get_domain_id()

    def nodes(self, hidden: bool = False) -> list[NodeName]:
        """The nodes, as often as they occur.

        Args:
            hidden: Whether to include hidden ones.

        Returns:
            Their names, in no order.
        """
        names = [NodeName.of(*pair) for pair in self._node.get_node_names_and_namespaces()]
        return [name for name in names if hidden or not name.hidden]

    def topics(self, hidden: bool = False) -> NamesAndTypes:
        """The topics and their types, sorted by name.

        Args:
            hidden: Whether to include hidden ones.

        Returns:
            Name and types of each.
        """
        return _visible(self._node.get_topic_names_and_types(), hidden)

    def services(self, hidden: bool = False) -> NamesAndTypes:
        """The services and their types, sorted by name.

        Args:
            hidden: Whether to include hidden ones.

        Returns:
            Name and types of each.
        """
        return _visible(self._node.get_service_names_and_types(), hidden)

    def publishers(self, topic: str) -> list[Endpoint]:
        """The publishers of a topic.

        Args:
            topic: Its absolute name.

        Returns:
            An `rclpy.topic_endpoint_info.TopicEndpointInfo` for each.
        """
        return list(self._node.get_publishers_info_by_topic(topic))

    def subscriptions(self, topic: str) -> list[Endpoint]:
        """The subscriptions of a topic.

        Args:
            topic: Its absolute name.

        Returns:
            An `rclpy.topic_endpoint_info.TopicEndpointInfo` for each.
        """
        return list(self._node.get_subscriptions_info_by_topic(topic))

    def view(self) -> Hashable:
        """All names and types together, to tell whether something changed."""
        pairs = [*self.topics(hidden=True), *self.services(hidden=True)]
        return (
            tuple(sorted(self.nodes(hidden=True))),
            tuple((name, *types) for name, types in pairs),
        )

    def settle(self) -> None:
        """Wait until the view is complete."""
        wait(lambda: None, self, Patience.for_lists(self._spin_time))

    def wait_for(self, look: Callable[[], T | None]) -> T | None:
        """Wait until something is there.

        Args:
            look: Answers what was looked for, or None as long as it is not there.

        Returns:
            What `look` found; None when the view is complete without it.
        """
        return wait(look, self, Patience.for_names(self._spin_time))


def _visible(pairs: NamesAndTypes, hidden: bool) -> NamesAndTypes:
    return [(name, types) for name, types in sorted(pairs) if hidden or not is_hidden(name)]
