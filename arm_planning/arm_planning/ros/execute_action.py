# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The action execute_trajectory, and the topic trajectory_execution_event."""

from __future__ import annotations

from typing import Any

from moveit_msgs.action import ExecuteTrajectory
from rclpy.action.server import CancelResponse
from rclpy.node import Node
from std_msgs.msg import String

from node_runner.action_goals import serve_goals

from ..exceptions import PlanningCode, PlanningError
from .background import error_code
from .execution import Execution, TrajectoryExecution

STOP = 'stop'  # the event that stops everything


class ExecuteAction:
    """Executes trajectories that clients have planned."""

    def __init__(self, node: Node, execution: TrajectoryExecution) -> None:
        self._node, self._execution = node, execution
        self._running: dict[bytes, Execution] = {}
        self._outcomes: dict[bytes, tuple[PlanningCode, str]] = {}
        self._server = serve_goals(
            node,
            ExecuteTrajectory,
            'execute_trajectory',
            start=self._start,
            conclude=self._conclude,
            cancel=self._cancel,
        )
        node.create_subscription(String, 'trajectory_execution_event', self._event, 10)

    def _start(self, handle: Any) -> None:  # noqa: ANN401  # rclpy has no types here
        key = bytes(handle.goal_id.uuid)

        def done(code: PlanningCode, reason: str) -> None:
            self._running.pop(key, None)
            self._outcomes[key] = code, reason
            self._server.notify_execute(handle, None)  # leads to _conclude

        goal = handle.request
        try:
            self._running[key] = self._execution.start(
                goal.trajectory.joint_trajectory, done, list(goal.controller_names)
            )
        except PlanningError as error:
            done(error.code, str(error))
            return
        handle.publish_feedback(ExecuteTrajectory.Feedback(state='MONITOR'))

    def _cancel(self, handle: Any) -> CancelResponse:  # noqa: ANN401
        running = self._running.get(bytes(handle.goal_id.uuid))
        if running is not None:
            self._execution.stop(running, reason='canceled')
        return CancelResponse.ACCEPT

    def _conclude(self, handle: Any) -> ExecuteTrajectory.Result:  # noqa: ANN401
        code, reason = self._outcomes.pop(bytes(handle.goal_id.uuid))
        handle.publish_feedback(ExecuteTrajectory.Feedback(state='IDLE'))
        if code is not PlanningCode.SUCCESS:
            self._node.get_logger().warning(f'execute_trajectory: {code.name}: {reason}')
        conclude(handle, code)
        return ExecuteTrajectory.Result(error_code=error_code(code, reason))

    def _event(self, message: String) -> None:
        if message.data == STOP:
            self._execution.stop_all('stopped by trajectory_execution_event')
            return
        self._node.get_logger().warning(
            f'trajectory_execution_event: unknown event {message.data!r}; there is {STOP!r}'
        )


def conclude(handle: Any, code: PlanningCode) -> None:  # noqa: ANN401
    """Give a goal the status of an outcome, as MoveIt does."""
    if code is PlanningCode.SUCCESS:
        handle.succeed()
    elif code is PlanningCode.PREEMPTED and handle.is_cancel_requested:
        handle.canceled()
    else:
        handle.abort()
