# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A ROS client that calls services of many nodes side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import time
from typing import Any

from std_srvs.srv import Trigger

from process_supervisor import CallError
from process_supervisor.graph_client import GraphClient


class ServiceClient(GraphClient):
    """A node of its own; use it in one thread."""

    def __init__(self, name: str, given_up: Callable[[], bool], namespace: str = '') -> None:
        """Join the ROS graph."""
        super().__init__(name, given_up, namespace)
        self._clients: dict[str, Any] = {}

    def prepare(self, services: Iterable[str]) -> None:
        """Create clients of services that will be called, so that they are matched in time."""
        for name in services:
            self._clients[name] = self.node.create_client(Trigger, name)

    def is_ready(self, service: str) -> bool:
        """Whether a service that was prepared is there."""
        return bool(self._clients[service].service_is_ready())

    def call(self, services: list[str], timeout: float) -> dict[str, str]:
        """Call services that were prepared side by side, each once its node knows this client.

        All together may take so long in [s].

        Returns:
            What each answered.

        Raises:
            CallError: One did not answer or refused; the message says why, for each.
            GivenUpError: It is no longer wanted.
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
