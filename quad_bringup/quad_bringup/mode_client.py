# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A small ROS client: what the controller is doing, and another mode for it."""

from __future__ import annotations

from collections.abc import Callable
import time

import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.signals import SignalHandlerOptions
from std_msgs.msg import String

from quad_msgs.srv import SetMode

from .exceptions import CallError, GivenUpError

SPIN = 0.05
"""Longest time in [s] after which a wait looks whether it shall be given up."""
REFUSED_PATIENCE = 3.0
"""Time in [s] for which a refused mode is asked for again."""
ASK_AGAIN = 0.2
"""Time in [s] between that."""
STATE_TOPIC = '/controller_node/state'
"""Topic on which the controller says what it is doing."""
LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)


class ModeClient:
    """A node of its own; use it in one thread."""

    def __init__(self, name: str, given_up: Callable[[], bool]) -> None:
        """Join the ROS graph.

        Args:
            name: Name of the node.
            given_up: True when nothing shall be waited for any more.
        """
        self._given_up = given_up
        self._state = ''
        self._context = Context()
        rclpy.init(context=self._context, signal_handler_options=SignalHandlerOptions.NO)
        self._node = Node(name, context=self._context, enable_rosout=False)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._modes = self._node.create_client(SetMode, 'set_mode')
        self._node.create_subscription(String, STATE_TOPIC, self._take_state, LATCHED)

    def close(self) -> None:
        """Leave the ROS graph."""
        self._executor.shutdown()
        self._node.destroy_node()
        self._context.try_shutdown()

    @property
    def state(self) -> str:
        """State of the controller, as it calls it; empty before it is heard."""
        return self._state

    def set_mode(self, mode: str, timeout: float) -> str:
        """Ask the controller for a mode; again for a while when it refuses.

        A controller that has just begun may not have heard of everything that it needs.

        Args:
            mode: One that it knows.
            timeout: Longest time in [s] for an answer.

        Returns:
            What it answered.

        Raises:
            CallError: It refused, or did not answer in time.
            GivenUpError: It is no longer wanted.
        """
        patience = time.monotonic() + REFUSED_PATIENCE
        while True:
            answer = self._ask(mode, timeout)
            if answer.success:
                return str(answer.message)
            if time.monotonic() > patience:
                raise CallError(f'the mode {mode!r} was refused: {answer.message}')
            self.listen(ASK_AGAIN)

    def _ask(self, mode: str, timeout: float) -> SetMode.Response:
        end = time.monotonic() + timeout
        self.wait_until(self._modes.service_is_ready, timeout, 'the service /set_mode')
        future = self._modes.call_async(SetMode.Request(mode=mode))
        left = max(0.0, end - time.monotonic())
        self.wait_until(future.done, left, f'an answer of /set_mode to {mode!r}')
        answer: SetMode.Response = future.result()
        return answer

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

    def _take_state(self, message: String) -> None:
        self._state = message.data
