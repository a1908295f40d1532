# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo's ROS client: calls services of many nodes side by side, and hears /diagnostics."""

from __future__ import annotations

from collections.abc import Callable, Iterable
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
import rclpy
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from std_srvs.srv import Trigger

from ..exceptions import CallError, GivenUpError
from .figures import Figures

SPIN = 0.05
"""Longest time in [s] after which a wait looks whether it shall be given up."""


class ArmClient:
    """A node of its own; use it in one thread.

    Attributes:
        figures: The latest of /diagnostics.
    """

    def __init__(self, given_up: Callable[[], bool]) -> None:
        """Join the ROS graph.

        Args:
            given_up: True when nothing shall be waited for any more.
        """
        self.figures = Figures()
        self._given_up = given_up
        self._context = rclpy.context.Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node('demo', context=self._context, enable_rosout=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._node.create_subscription(DiagnosticArray, '/diagnostics', self._take, 50)
        self._clients: dict[str, Any] = {}

    def close(self) -> None:
        """Leave the ROS graph."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    def _take(self, message: DiagnosticArray) -> None:
        self.figures = self.figures.updated(message.status)

    def listen(self, duration: float) -> None:
        """Hear what comes in.

        Args:
            duration: For how long in [s].
        """
        end = time.monotonic() + duration
        while (left := end - time.monotonic()) > 0:
            self._executor.spin_once(timeout_sec=left)

    def wait_until(self, condition: Callable[[], bool], timeout: float, what: str) -> None:
        """Wait for something.

        Args:
            condition: True when it is there; asked after whatever comes in.
            timeout: Longest time in [s].
            what: What is waited for, for the message.

        Raises:
            CallError: It did not come in time.
            GivenUpError: It is no longer wanted.
        """
        end = time.monotonic() + timeout
        while not condition():
            if time.monotonic() > end:
                raise CallError(f'waited {timeout:g} s in vain for {what}')
            if self._given_up():
                raise GivenUpError(what)
            self._executor.spin_once(timeout_sec=SPIN)

    def prepare(self, services: Iterable[str]) -> None:
        """Look for services that will be called, so that they are known when they are needed.

        Args:
            services: Their names, all of type std_srvs/Trigger.
        """
        for name in services:
            self._clients[name] = self._node.create_client(Trigger, name)

    def call(self, services: list[str], timeout: float) -> dict[str, str]:
        """Call services side by side.

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
