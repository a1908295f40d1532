# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One goal of an action, from its request to its end; nothing waits for it."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.action.client import ActionClient
from rclpy.task import Future

Done = Callable[[Any, str], None]
"""Takes the result, or None and why there is none."""


class ActionCall:
    """A goal that may be canceled at any time, also before the server has answered.

    Attributes:
        ended: There is a result, or will be none.
    """

    def __init__(self, client: ActionClient, goal: Any, done: Done) -> None:  # noqa: ANN401
        """Send it."""
        self._done, self._handle = done, None
        self._is_canceled = self.ended = False
        client.send_goal_async(goal).add_done_callback(self._answered)

    def cancel(self) -> None:
        """Cancel it."""
        if self._is_canceled:
            return
        self._is_canceled = True
        if self._handle is not None:
            self._handle.cancel_goal_async()

    def _answered(self, future: Future) -> None:
        if future.exception() is not None:
            self._end(None, f'no answer: {future.exception()}')
            return
        handle = future.result()
        if not handle.accepted:
            self._end(None, 'the goal was not accepted')
            return
        self._handle = handle
        if self._is_canceled:
            handle.cancel_goal_async()
        handle.get_result_async().add_done_callback(self._ended)

    def _ended(self, future: Future) -> None:
        error = future.exception()
        if error is not None:
            self._end(None, f'no result: {error}')
        else:
            self._end(future.result().result, '')

    def _end(self, result: Any, why: str) -> None:  # noqa: ANN401
        self.ended = True
        self._done(result, why)
