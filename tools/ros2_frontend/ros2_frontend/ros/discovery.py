# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Waiting until the view of the ROS graph is complete.

There is no daemon: each command joins the graph anew. Where ros2cli waits a fixed 0.5 s, which is
too long most of the time and too short now and then, this waits for what it needs: a name, or a
complete view. Complete is a view with every participant of this host, with the name of the node of
every endpoint, and without a change for a moment. Missing participants are made to announce
themselves (`spdp`).
"""

from __future__ import annotations

from collections.abc import Callable, Hashable
from contextlib import closing
from dataclasses import dataclass
import os
import time
from typing import Protocol, TypeVar

from ..aliases import Endpoint, NamesAndTypes
from .dds import is_this_host
from .participants import DiscoveryPorts, read_ports
from .spdp import Inquiry

T = TypeVar('T')

_POLL = 0.01  # [s]; one look costs below 1 ms with 30 topics
_LIMIT = 4.0  # [s]; without an inquiry, a participant announces itself every 3 s
_QUIET_FOR_LISTS = 0.25  # [s]; the endpoints of a participant come in bursts, 60 ms apart and more
_QUIET_FOR_NAMES = 0.3  # [s]; a node that is just starting gets its chance
_QUIET_FOR_NETWORK = 0.5  # [s]; participants that the kernel does not list cannot be counted
_INQUIRY_PERIOD = 0.3  # [s]; an answer with all endpoints takes 0.1 s

_PREFIX = 12  # [byte] of an endpoint's GUID that name its participant
_UNKNOWN_NODE = '_NODE_NAME_UNKNOWN_'  # rmw's word as long as a participant's nodes are not known
_EVERY_NODE_HAS = ('/rosout', '/parameter_events')


class Endpoints(Protocol):
    """What discovery looks at; `graph.Graph` is one.

    Attributes:
        domain_id: The ROS domain.
    """

    domain_id: int

    def topics(self, hidden: bool = False) -> NamesAndTypes:
        """The topics and their types."""

    def publishers(self, topic: str) -> list[Endpoint]:
        """The publishers of a topic."""

    def subscriptions(self, topic: str) -> list[Endpoint]:
        """The subscriptions of a topic."""

    def view(self) -> Hashable:
        """All names and types together."""


@dataclass(frozen=True, slots=True)
class WaitLimits:
    """How long to wait.

    Attributes:
        limit: Longest time of all [s].
        quiet: How long a complete view has to stay as it is [s].
    """

    limit: float
    quiet: float

    @classmethod
    def for_lists(cls, spin_time: float | None) -> WaitLimits:
        """For a command that wants all there is.

        Args:
            spin_time: What the user set [s], or None.

        Returns:
            The limits; never beyond what the user set.
        """
        quiet = _QUIET_FOR_LISTS if is_this_host(os.environ) else _QUIET_FOR_NETWORK
        return cls(_LIMIT if spin_time is None else spin_time, quiet)

    @classmethod
    def for_names(cls, spin_time: float | None) -> WaitLimits:
        """For a command that wants one name, which may be about to appear.

        Args:
            spin_time: What the user set [s], or None.

        Returns:
            The limits; all that the user set.
        """
        return cls(_LIMIT, _QUIET_FOR_NAMES) if spin_time is None else cls(spin_time, spin_time)

    def at_most(self, limit: float) -> WaitLimits:
        """The same with an upper bound.

        Args:
            limit: Longest time of all [s].

        Returns:
            The limits.
        """
        return WaitLimits(min(limit, self.limit), self.quiet)


@dataclass(frozen=True, slots=True)
class Census:
    """How much of the graph is known.

    Attributes:
        missing: Participants of this host that are unknown.
        unnamed: Endpoints whose node is unknown.
    """

    missing: int
    unnamed: int


def take_census(graph: Endpoints, ports: DiscoveryPorts) -> Census:
    """Compare the view with the participants that the kernel knows.

    Args:
        graph: The view.
        ports: The kernel's list.

    Returns:
        What is missing. Only as many topics are looked at as it takes.
    """
    known: set[bytes] = set()
    unnamed = 0
    others = (name for name, _ in graph.topics(hidden=True) if name not in _EVERY_NODE_HAS)
    for topic in (*_EVERY_NODE_HAS, *others):
        if topic not in _EVERY_NODE_HAS and len(known) >= ports.count:
            break
        for endpoint in (*graph.publishers(topic), *graph.subscriptions(topic)):
            known.add(bytes(endpoint.endpoint_gid[:_PREFIX]))
            unnamed += endpoint.node_name == _UNKNOWN_NODE
    return Census(max(ports.count - len(known), 0), unnamed)


def wait(look: Callable[[], T | None], graph: Endpoints, limits: WaitLimits) -> T | None:
    """Wait until something is found, or until the view is complete without it.

    Args:
        look: Answers what was looked for, or None as long as it is not there.
        graph: The view.
        limits: How long to wait.

    Returns:
        What `look` found, or None.
    """
    start = changed = time.monotonic()
    sent = start - _INQUIRY_PERIOD
    before: Hashable = None
    with closing(Inquiry()) as inquiry:
        while True:
            found = look()
            now = time.monotonic()
            if found is not None or now - start >= limits.limit:
                return found
            ports, view = read_ports(graph.domain_id), graph.view()
            census = take_census(graph, ports)
            if census.missing and now - sent >= _INQUIRY_PERIOD:
                inquiry.send(ports)
                sent = now
            quiet = limits.quiet if ports.own else max(limits.quiet, _QUIET_FOR_NETWORK)
            if census.missing or census.unnamed or view != before:
                before, changed = view, now
            elif now - changed >= quiet:
                return None
            time.sleep(_POLL)
