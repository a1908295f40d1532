# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A ROS node of the test itself, in a domain of its own."""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Any, TYPE_CHECKING

import rclpy
from rclpy.action.client import ActionClient
from rclpy.action.server import ActionServer
from rclpy.client import Client
from rclpy.context import Context
from rclpy.experimental.events_executor import EventsExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_srvs.srv import Trigger

from node_runner import ServerMatch

if TYPE_CHECKING:
    from typing_extensions import Self

LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


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
        return self.client_of(service_type, name, timeout).call_async(request)

    def client_of(self, service_type: Any, name: str, timeout: float = 60.0) -> Client:
        """Return the client of a service, which knows it."""
        if name not in self._clients:
            self._clients[name] = client = self.node.create_client(service_type, name)
            matched = ServerMatch(self.node, [name])
            self.spin_until(matched.advance, timeout, f'node of {name} that knows this client')
        client = self._clients[name]
        if not client.wait_for_service(timeout):
            raise AssertionError(f'there is no service {client.service_name}')
        return client

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

    def __exit__(self, *_: object) -> None:
        """Leave the domain."""
        self._executor.shutdown()
        destroy_with_actions(self.node)
        rclpy.shutdown(context=self._context)


def destroy_with_actions(node: Node) -> None:
    """Destroy a node, and its actions, which rclpy leaves: they keep it in its domain."""
    for waitable in list(node.waitables):
        if isinstance(waitable, (ActionClient, ActionServer)):
            waitable.destroy()
    node.destroy_node()
