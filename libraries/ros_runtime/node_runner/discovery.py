# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Discovers other nodes by name, and checks if their services have matched our clients."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
import math
import threading
import time

from rcl_interfaces.srv import GetParameterTypes
from rclpy.client import Client
from rclpy.node import Node, NodeNameNonExistentError
from rclpy.task import Future

DISCOVERY_TIME = 2.0  # [s] in which nodes that run are discovered
_LOOK_PERIOD = 0.1  # [s]

PROBE = 'get_parameter_types'  # a service of nearly every node that changes nothing
PROBE_PERIOD = 1.0  # time after which the answer of a probe counts as lost, in [s]


def other_nodes(node: Node, names: Iterable[str], own: Sequence[str]) -> list[str]:
    """Return the nodes with the given names that other processes run."""
    graph = [
        f'{namespace.rstrip("/")}/{name}'
        for name, namespace in node.get_node_names_and_namespaces()
    ]
    return sorted(name for name in set(names) if graph.count(name) > own.count(name))


def discover_other_nodes(
    node: Node, names: Iterable[str], own: Sequence[str], stop: threading.Event
) -> list[str]:
    """Wait until discovery is complete or a node is found; return the nodes found."""
    wanted, deadline = set(names), time.monotonic() + DISCOVERY_TIME
    while time.monotonic() < deadline and not stop.wait(_LOOK_PERIOD):
        if found := other_nodes(node, wanted, own):
            return found
    return []


class ServerMatch:
    """Checks whether the nodes that offer services have matched the clients of a node.

    A client discovers a server before the server discovers the client; if that takes over 0.1 s,
    as on a busy machine, rmw_fastrtps drops the answer. A request that moves something must not be
    repeated. But DDS announces readers in order of creation: once a client that was created later,
    with a repeatable request, gets an answer, the others are matched, too.
    """

    def __init__(self, node: Node, services: Iterable[str]) -> None:
        """Prepare; the node has already created its clients of these services."""
        self._node = node
        self._services = {node.resolve_service_name(name) for name in services}
        self._probes: dict[str, Client] = {}
        self._answers: dict[str, list[Future]] = {}
        self._asked = -math.inf

    def advance(self) -> bool:
        """Continue the check while the node is spun; return True when all have matched.

        A node without parameter services cannot be checked, and counts as matched.
        """
        if self._services:
            self._find_servers()
        if time.monotonic() - self._asked > PROBE_PERIOD:
            self._asked = time.monotonic()
            for name, probe in self._probes.items():
                if probe.service_is_ready():
                    self._answers[name].append(probe.call_async(GetParameterTypes.Request()))
        answered = (any(each.done() for each in tries) for tries in self._answers.values())
        if self._services or not all(answered):
            return False
        for probe in self._probes.values():
            self._node.destroy_client(probe)
        self._probes.clear()
        return True

    def _find_servers(self) -> None:
        for name, namespace in self._node.get_node_names_and_namespaces():
            try:
                found = self._node.get_service_names_and_types_by_node(name, namespace)
            except NodeNameNonExistentError:  # it has ended in between
                continue
            offered = {service for service, _ in found}
            if not offered & self._services:
                continue
            self._services -= offered
            probe = f'{namespace.rstrip("/")}/{name}/{PROBE}'
            if probe in offered and probe not in self._probes:
                self._probes[probe] = self._node.create_client(GetParameterTypes, probe)
                self._answers[probe] = []
                self._asked = -math.inf
