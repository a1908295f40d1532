# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Action goals that a control loop carries out, so that no callback waits for their end."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from rclpy.action.server import ActionServer, CancelResponse
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

RESULT_TIMEOUT = 10.0
"""Time in [s] that an ended goal is kept for late requests, as by rcl; rclpy keeps it for 900."""


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

    return ActionServer(
        node,
        action,
        name,
        execute_callback=conclude,
        handle_accepted_callback=begin,
        cancel_callback=cancel,
        result_timeout=RESULT_TIMEOUT,
    )
