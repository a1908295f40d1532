# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A ROS node of the test itself, in a domain of its own."""

from __future__ import annotations

from collections.abc import Callable
import math
import time
from typing import Any, TYPE_CHECKING

from rcl_interfaces.srv import GetParameterTypes
import rclpy
from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.client import Client
from rclpy.context import Context
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node, NodeNameNonExistentError
from std_srvs.srv import Trigger

if TYPE_CHECKING:
    from types import TracebackType

    from typing_extensions import Self


ANSWER_TIME = 1.0
"""Time in [s] after which an answer counts as lost."""


class RosClient:
    """Calls services and listens to topics."""

    def __init__(self, domain_id: int, name: str = 'test_client') -> None:
        self._context = Context()
        rclpy.init(context=self._context, domain_id=domain_id)
        self.node = Node(name, context=self._context)
        self._actions: dict[str, ActionClient] = {}
        self._clients: dict[str, Client] = {}
        self._executor = EventsExecutor(context=self._context)
        self._executor.add_node(self.node)

    def call(
        self, service_type: Any, name: str, request: Any = None, timeout: float = 60.0
    ) -> Any:
        """Call a service and return its response; without a request, with an empty one."""
        request = service_type.Request() if request is None else request
        future = self.call_async(service_type, name, request, timeout)
        self.spin_until(future.done, timeout, f'an answer of {name}')
        return future.result()

    def call_async(self, service_type: Any, name: str, request: Any, timeout: float = 60.0) -> Any:
        """Wait for a service, call it and return the future."""
        client = self.client_of(service_type, name, timeout)
        self._wait_for(client, timeout)
        return client.call_async(request)

    def client_of(self, service_type: Any, name: str, timeout: float = 60.0) -> Client:
        """Return the client of a service, which knows it."""
        if name not in self._clients:
            self._clients[name] = client = self.node.create_client(service_type, name)
            self._wait_for(client, timeout)
            self._become_known(client.service_name, timeout)
        return self._clients[name]

    @staticmethod
    def _wait_for(client: Client, timeout: float) -> None:
        if not client.wait_for_service(timeout):
            raise AssertionError(f'there is no service {client.service_name}')

    def _become_known(self, service: str, timeout: float) -> None:
        """Wait until the node of a service knows the client of it.

        On a busy machine DDS loses the answer to a client that the server does not know yet.
        Clients become known in the order in which they were made; so once an answer has come to
        one that was made later, and may be asked for again and again, the others are known.
        """
        services: list[str] = []

        def found() -> bool:
            for node in self.node.get_node_names_and_namespaces():
                services[:] = self._services_of(*node)
                if service in services:
                    return True
            return False

        self.spin_until(found, timeout, f'node of {service}')
        probes = [name for name in services if name.endswith('/get_parameter_types')]
        if not probes:
            return
        probe = self.node.create_client(GetParameterTypes, probes[0])
        self._wait_for(probe, timeout)
        answers: list[Any] = []
        asked = -math.inf

        def answered() -> bool:
            nonlocal asked
            if time.monotonic() - asked > ANSWER_TIME:
                answers.append(probe.call_async(GetParameterTypes.Request()))
                asked = time.monotonic()
            return any(answer.done() for answer in answers)

        self.spin_until(answered, timeout, f'an answer of {probes[0]}')
        self.node.destroy_client(probe)

    def _services_of(self, node: str, namespace: str) -> list[str]:
        try:
            found = self.node.get_service_names_and_types_by_node(node, namespace)
        except NodeNameNonExistentError:  # it has ended in between
            return []
        return [name for name, _ in found]

    def trigger(self, name: str, timeout: float = 60.0) -> Any:
        """Call a std_srvs/Trigger."""
        return self.call(Trigger, name, Trigger.Request(), timeout)

    def action(self, action_type: Any, name: str) -> ActionClient:
        """Return the one client of an action: a server does not know a new one at once."""
        if name not in self._actions:
            self._actions[name] = ActionClient(self.node, action_type, name)
        return self._actions[name]

    def listen(self, message_type: Any, topic: str, qos: Any = 10) -> list[Any]:
        """Subscribe to a topic; the list grows while the client spins."""
        messages: list[Any] = []
        self.node.create_subscription(message_type, topic, messages.append, qos)
        return messages

    def spin_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Serve callbacks until a condition holds."""
        deadline = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > deadline:
                raise AssertionError(f'no {what} within {timeout} s')
            self._executor.spin_once(0.05)

    def spin_for(self, seconds: float) -> None:
        """Serve callbacks for a time in [s]."""
        end = time.monotonic() + seconds
        self.spin_until(lambda: time.monotonic() >= end, seconds + 20.0, 'end of that time')

    def __enter__(self) -> Self:
        """Use it in a with statement."""
        return self

    def __exit__(
        self,
        exc_type: type[BaseException] | None,
        exc: BaseException | None,
        traceback: TracebackType | None,
    ) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        for waitable in list(self.node.waitables):
            if isinstance(waitable, (ActionClient, ActionServer)):
                waitable.destroy()  # rclpy leaves it, and it keeps the node in its domain
        self.node.destroy_node()
        rclpy.shutdown(context=self._context)
