# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Asks the controller for modes, and never waits for the answer."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from rclpy.node import Node
from rclpy.task import Future

from quad_msgs.srv import SetMode

from ..modes import Mode

ANSWER_PATIENCE = 3.0  # [s]
SAME_AGAIN = 0.7  # [s] within which the same question is the keyboard repeating a key


class ModeClient:
    """Client of ``set_mode``.

    Attributes:
        mode: The mode that was granted last; None before.
    """

    def __init__(self, node: Node, say: Callable[[str], None]) -> None:
        """Make the client.

        Args:
            node: The node; somebody has to spin it for answers to arrive.
            say: Is told the answers, and why there is none.
        """
        self.mode: Mode | None = None
        self._client = node.create_client(SetMode, 'set_mode')
        self._name = node.resolve_service_name('set_mode')
        self._say = say
        self._asked: tuple[Mode, float] | None = None
        self._future: Future | None = None

    def ask(self, mode: Mode, now: float) -> None:
        """Ask for a mode.

        Args:
            mode: Which.
            now: Time [s].
        """
        if (
            self._asked is not None
            and self._asked[0] is mode
            and now - self._asked[1] < SAME_AGAIN
        ):
            return
        self._asked = mode, now
        if not self._client.service_is_ready():
            self._say(
                f'{mode.value}: there is no service {self._name}; is controller_node '
                'running, with the same ROS_DOMAIN_ID and namespace?'
            )
            return
        if self._future is not None:
            self._client.remove_pending_request(self._future)
        self._future = self._client.call_async(SetMode.Request(mode=mode.value))
        self._future.add_done_callback(partial(self._answered, mode))

    def check(self, now: float) -> None:
        """Give an answer up that is overdue.

        Args:
            now: Time [s].
        """
        if self._future is None or self._asked is None or now - self._asked[1] < ANSWER_PATIENCE:
            return
        self._client.remove_pending_request(self._future)
        self._future = None
        self._say(
            f'{self._asked[0].value}: no answer of {self._name} within '
            f'{ANSWER_PATIENCE:.0f} s; does controller_node still run?'
        )

    def _answered(self, mode: Mode, future: Future) -> None:
        if future is not self._future:
            return
        self._future = None
        response = future.result()
        if response is None:
            return
        if response.success:
            self.mode = mode
            self._say(f'mode: {response.message or mode.value}')
        else:
            self._say(f'{mode.value} refused: {response.message}')
