# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS graph as one node sees it."""

from __future__ import annotations

from argparse import Namespace
from collections.abc import Callable, Hashable, Iterator
import contextlib
import math
import time
from typing import TypeVar

from ..aliases import Endpoint, NamesAndTypes
from ..cli.arguments import GRAPH_ARGUMENTS
from ..cli.verb import Argument, Verb
from .discovery import wait, WaitLimits
from .names import is_hidden, NodeName
from .session import open_session, Session

T = TypeVar('T')


class Graph:
    """What is in the ROS graph, and waiting for it.

    Attributes:
        session: The session that looks.
        domain_id: The ROS domain.
    """

    def __init__(self, session: Session, spin_time: float | None = None) -> None:
        """Look at the graph through a session.

        Args:
            session: The session; its node is part of the graph.
            spin_time: Longest time [s] to wait for discovery; None decides by the graph.
        """
        self.session = session
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

    def offered_services(self) -> dict[str, list[str]]:
        """The services that some node offers; `services` names those that are only called, too.

        Returns:
            The types by name.
        """
        from rclpy.node import NodeNameNonExistentError

        found: dict[str, list[str]] = {}
        for node in self.nodes(hidden=True):
            with contextlib.suppress(NodeNameNonExistentError):  # it left meanwhile
                query = self._node.get_service_names_and_types_by_node
                found.update(query(node.name, node.namespace))
        return found

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
        """All names and types together, to see whether something changed."""
        pairs = [*self.topics(hidden=True), *self.services(hidden=True)]
        return (
            tuple(sorted(self.nodes(hidden=True))),
            tuple((name, *types) for name, types in pairs),
        )

    def settle(self) -> None:
        """Wait until the view is complete."""
        wait(lambda: None, self, WaitLimits.for_lists(self._spin_time))

    def wait_for(self, look: Callable[[], T | None], limit: float = math.inf) -> T | None:
        """Wait until something is there.

        Args:
            look: Answers what was looked for, or None as long as it is not there.
            limit: Longest time [s], besides what the graph decides.

        Returns:
            What `look` found; None when the view is complete without it.
        """
        return wait(look, self, WaitLimits.for_names(self._spin_time).at_most(limit))

    def wait_until(self, look: Callable[[], T | None], timeout: float | None = None) -> T | None:
        """Wait until something is there, however long it takes.

        Args:
            look: Answers what was looked for, or None as long as it is not there.
            timeout: Longest time [s]; None waits without limit.

        Returns:
            What `look` found; None only after `timeout`.
        """
        deadline = time.monotonic() + (math.inf if timeout is None else timeout)
        found = look()
        while found is None and (left := deadline - time.monotonic()) > 0.0:
            found = self.wait_for(look, left)
        return found


@contextlib.contextmanager
def open_graph(args: Namespace) -> Iterator[Graph]:
    """Join the ROS graph for one command, and look at it.

    Args:
        args: Parsed `GRAPH_ARGUMENTS`.

    Yields:
        The graph; the node that looks at it is gone afterwards.
    """
    with open_session(args) as session:
        yield Graph(session, args.spin_time)


def graph_verb(*arguments: Argument) -> Callable[[Callable[[Graph, Namespace], int | None]], Verb]:
    """Make a verb of a function that looks at the ROS graph.

    Args:
        *arguments: Its arguments behind those of the graph.
    """

    def declare(run: Callable[[Graph, Namespace], int | None]) -> Verb:
        def main(args: Namespace) -> int | None:
            with open_graph(args) as graph:
                return run(graph, args)

        return Verb((*GRAPH_ARGUMENTS, *arguments), main)

    return declare


def _visible(pairs: NamesAndTypes, hidden: bool) -> NamesAndTypes:
    return [(name, types) for name, types in sorted(pairs) if hidden or not is_hidden(name)]
