# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A ROS client that calls services of many nodes side by side."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import math
import time
from typing import Any

from rclpy.task import Future
from std_srvs.srv import Trigger

from process_supervisor import CallError
from process_supervisor.graph_client import GraphClient

ANSWER_TIME = 10.0
"""After which an answer counts as lost in [s]; enabling takes less."""


class ServiceClient(GraphClient):
    """A node of its own; use it in one thread."""

    def __init__(self, name: str, given_up: Callable[[], bool], namespace: str = '') -> None:
        """Join the ROS graph.

        Args:
            name: Name of the node.
            given_up: True when nothing shall be waited for any more.
            namespace: That of the arm.
        """
        super().__init__(name, given_up, namespace)
        self._clients: dict[str, Any] = {}

    def prepare(self, services: Iterable[str]) -> None:
        """Look for services that will be called, so that they are known when they are needed.

        Args:
            services: Their names, all of type std_srvs/Trigger.
        """
        for name in services:
            self._clients[name] = self.node.create_client(Trigger, name)

    def call(self, services: list[str], timeout: float) -> dict[str, str]:
        """Call services side by side.

        One that does not answer is called again: DDS loses the answer where the server does not
        know this client yet, which takes a while on a busy machine. So they may be none that do
        more when they are called twice.

        Args:
            services: Names that were prepared.
            timeout: Longest time in [s] for all together.

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
        answers: dict[str, Trigger.Response] = {}
        asked: dict[str, list[Future]] = {name: [] for name in services}
        called = -math.inf

        def answered() -> bool:
            nonlocal called
            for name, futures in asked.items():
                done = [future for future in futures if future.done()]
                if done and name not in answers:
                    answers[name] = done[0].result()
            if time.monotonic() - called > ANSWER_TIME:
                called = time.monotonic()
                for name in asked.keys() - answers.keys():
                    asked[name].append(clients[name].call_async(Trigger.Request()))
            return answers.keys() == asked.keys()

        left = max(0.0, end - time.monotonic())
        self.wait_until(answered, left, f'the answers of {", ".join(services)}')
        refused = [f'{name}: {each.message}' for name, each in answers.items() if not each.success]
        if refused:
            raise CallError('; '.join(refused))
        return {name: each.message for name, each in answers.items()}
