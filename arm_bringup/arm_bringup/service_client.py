# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""ROS client that calls services of many nodes in parallel."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import time
from typing import Any

from std_srvs.srv import Trigger

from process_supervisor import CallError
from process_supervisor.graph_client import GraphClient


class ServiceClient(GraphClient):
    """Service client with its own node; use it in one thread."""

    def __init__(self, name: str, given_up: Callable[[], bool], namespace: str = '') -> None:
        """Join the ROS graph."""
        super().__init__(name, given_up, namespace)
        self._clients: dict[str, Any] = {}

    def prepare(self, services: Iterable[str]) -> None:
        """Create clients for services to call later, so that DDS discovers them in time."""
        for name in services:
            self._clients[name] = self.node.create_client(Trigger, name)

    def is_ready(self, service: str) -> bool:
        """Return whether a prepared service is available."""
        return bool(self._clients[service].service_is_ready())

    def call(self, services: list[str], timeout: float) -> dict[str, str]:
        """Call prepared services in parallel, each after its node has discovered this client.

        ``timeout`` in [s] is for all calls together.

        Returns:
            The response message of each service.

        Raises:
            CallError: A service did not answer or refused; the message says why, for each.
            GivenUpError: The caller gave up.
        """
        clients = {name: self._clients[name] for name in services}
        end = time.monotonic() + timeout
        self.wait_until(
            lambda: all(client.service_is_ready() for client in clients.values()),
            timeout,
            f'the services {", ".join(services)}',
        )
        there = {name for name, client in self._clients.items() if client.service_is_ready()}
        self.wait_until_known(there, max(0.0, end - time.monotonic()))
        futures = {name: client.call_async(Trigger.Request()) for name, client in clients.items()}
        self.wait_until(
            lambda: all(future.done() for future in futures.values()),
            max(0.0, end - time.monotonic()),
            f'the answers of {", ".join(services)}',
        )
        answers = {name: future.result() for name, future in futures.items()}
        refused = [f'{name}: {each.message}' for name, each in answers.items() if not each.success]
        if refused:
            raise CallError('; '.join(refused))
        return {name: each.message for name, each in answers.items()}
