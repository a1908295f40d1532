# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Action goals that a control loop carries out, so that no callback waits for their end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.action.server import ActionServer, CancelResponse
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.clock import Clock
from rclpy.clock_type import ClockType
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.task import Future

RESULT_TIMEOUT = 10.0
"""Time in [s] that an ended goal is kept for late requests, as by rcl; rclpy keeps it for 900."""

ANSWER_DELAY = 0.02
"""Least time in [s] from a request to its answer.

Clients of rclpy 7.1 note a request after it was sent, and drop an answer that another thread gets
before: 1 of 40 motions of pymoveit2 waited for ever. Python switches threads every 5 ms, and with
several of them, or on a busy computer, it takes some switches. Cancel requests are not delayed,
because the motion would go on meanwhile.
"""


class _Server(ActionServer):
    """Does not answer at once, see ``ANSWER_DELAY``."""

    async def _execute_goal_request(self, request: Any) -> None:  # noqa: ANN401  # rclpy has no types
        await self._delayed()
        await super()._execute_goal_request(request)

    async def _execute_get_result_request(self, request: Any) -> None:  # noqa: ANN401
        await self._delayed()
        await super()._execute_get_result_request(request)

    async def _delayed(self) -> None:
        elapsed = Future()
        steady = Clock(clock_type=ClockType.STEADY_TIME)  # simulated time may stand still
        timer = self._node.create_timer(
            ANSWER_DELAY,
            lambda: elapsed.set_result(None),
            callback_group=self.callback_group,
            clock=steady,
        )
        await elapsed
        self._node.destroy_timer(timer)


def serve_goals(
    node: Node,
    action: Any,  # noqa: ANN401  # rclpy has no types here
    name: str,
    *,
    start: Callable[[Any], None],
    conclude: Callable[[Any], Any],
    cancel: Callable[[Any], CancelResponse],
) -> ActionServer:
    """Offer an action.

    Args:
        node: Of the server.
        action: Its type.
        name: Its name.
        start: Begins with a goal that was accepted: a ``ServerGoalHandle``.
        conclude: Ends a goal, in the executor after the server's ``notify_execute(goal, None)``;
            returns the result.
        cancel: Answers the request to cancel a goal.
    """

    def begin(goal: Any) -> None:  # noqa: ANN401
        # goal.execute() would end the goal when its callback returns, which is now
        goal._update_state(rclpy_implementation.GoalEvent.EXECUTE)  # noqa: SLF001
        start(goal)

    return _Server(
        node,
        action,
        name,
        execute_callback=conclude,
        handle_accepted_callback=begin,
        cancel_callback=cancel,
        result_timeout=RESULT_TIMEOUT,
        # an executor that heeds groups would wait in one for the timer of the same
        callback_group=ReentrantCallbackGroup(),
    )
