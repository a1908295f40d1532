# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A small ROS client: what the controller is doing, and another mode for it."""

from __future__ import annotations

from collections.abc import Callable
import time

from std_msgs.msg import String

from node_runner import LATCHED
from process_supervisor import CallError
from process_supervisor.graph_client import GraphClient
from quad_msgs.srv import SetMode

REFUSAL_TIMEOUT = 3.0
"""Time in [s] for which a refused mode is requested again."""
RETRY_PERIOD = 0.2
"""Time in [s] between that."""
STATE_TOPIC = 'controller_node/state'
"""Topic on which the controller publishes what it is doing."""


class ModeClient(GraphClient):
    """A node of its own; use it in one thread."""

    def __init__(self, name: str, given_up: Callable[[], bool], namespace: str = '') -> None:
        """Join the ROS graph."""
        super().__init__(name, given_up, namespace)
        self._state = ''
        self._modes = self.node.create_client(SetMode, 'set_mode')
        self.node.create_subscription(String, STATE_TOPIC, self._take_state, LATCHED)

    @property
    def state(self) -> str:
        """State of the controller, as it calls it; empty before it is received."""
        return self._state

    def set_mode(self, mode: str, timeout: float) -> str:
        """Ask the controller for a mode; again for a while when it refuses.

        A controller that has just begun may not have received everything that it needs.

        Args:
            mode: One that it knows.
            timeout: Longest time in [s] for an answer.

        Returns:
            What it answered.

        Raises:
            CallError: It refused, or did not answer in time.
            GivenUpError: It is no longer wanted.
        """
        deadline = time.monotonic() + REFUSAL_TIMEOUT
        while True:
            answer = self._request(mode, timeout)
            if answer.success:
                return str(answer.message)
            if time.monotonic() > deadline:
                raise CallError(f'the mode {mode!r} was refused: {answer.message}')
            self.listen(RETRY_PERIOD)

    def _request(self, mode: str, timeout: float) -> SetMode.Response:
        end = time.monotonic() + timeout
        self.wait_until(self._modes.service_is_ready, timeout, 'the service /set_mode')
        self.wait_until_known(['set_mode'], max(0.0, end - time.monotonic()))
        future = self._modes.call_async(SetMode.Request(mode=mode))
        left = max(0.0, end - time.monotonic())
        self.wait_until(future.done, left, f'an answer of /set_mode to {mode!r}')
        answer: SetMode.Response = future.result()
        return answer

    def _take_state(self, message: String) -> None:
        self._state = message.data
