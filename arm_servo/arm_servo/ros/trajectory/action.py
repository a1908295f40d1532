# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The action FollowJointTrajectory: every goal ends with a code and the reason."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from control_msgs.action import FollowJointTrajectory
from rclpy.node import Node

from arm_trajectory import GoalCode
from node_runner.action_goals import Ending

from ...controllers.controller import Outcome, refused
from ...controllers.trajectory import Execution
from ...core.gateway import CommandGateway
from ...core.motion_queue import MotionCommand
from ..motion_goals import MotionGoal, MotionGoals, START_TIMEOUT
from .messages import difference, point_of

START_TIMEOUT_PER_POINT = 0.01  # time to plan each point of a goal in [s]


class TrajectoryAction:
    """The action server."""

    def __init__(
        self,
        node: Node,
        gateway: CommandGateway,
        rate: float,
        follow: Callable[[Any, int], MotionCommand],
    ) -> None:
        """Offer ``~/follow_joint_trajectory``.

        Args:
            rate: Rate of the feedback in [Hz].
            follow: Requests the trajectory of a goal message with its number; raises an ArmError.
        """
        self._node, self._gateway = node, gateway
        self._goals = MotionGoals(
            node,
            gateway,
            FollowJointTrajectory,
            '~/follow_joint_trajectory',
            accept=MotionGoal,
            request=lambda goal: follow(goal.handle.request, goal.number),
            canceled='canceled: at rest on the path',
            conclude=self._conclude,
            fail=self._fail,
        )
        node.create_timer(1.0 / rate, lambda: self._goals.watch(self._look))

    def _look(self, goal: MotionGoal) -> None:
        count = len(goal.handle.request.trajectory.points)
        timeout = START_TIMEOUT + START_TIMEOUT_PER_POINT * count
        goal.outcome = self._goals.outcome(goal, timeout)
        if goal.outcome is not None:
            self._goals.end(goal)
        elif goal.command is not None and goal.command.execution is not None:
            self._publish_feedback(goal.handle, goal.command.execution)

    def _publish_feedback(self, handle: Any, execution: Execution) -> None:  # noqa: ANN401  # rclpy has no types here
        state = execution.feedback
        feedback = FollowJointTrajectory.Feedback(
            joint_names=list(self._gateway.model.joints),
            desired=point_of(state.desired, state.time),
            actual=point_of(state.actual, state.time),
            error=point_of(
                difference(self._gateway.model.limits, state.desired, state.actual), state.time
            ),
        )
        feedback.header.stamp = self._node.get_clock().now().to_msg()
        handle.publish_feedback(feedback)

    def _conclude(self, goal: MotionGoal) -> tuple[Ending, FollowJointTrajectory.Result]:
        outcome = goal.outcome or Outcome(GoalCode.INVALID_GOAL, 'ended without an outcome')
        code = outcome.code
        if outcome.canceled:
            ending = Ending.CANCELED
            code = code if goal.handle.is_cancel_requested else GoalCode.INVALID_GOAL
        else:
            ending = Ending.SUCCEEDED if code is GoalCode.SUCCESSFUL else Ending.ABORTED
        return ending, self._result(code, outcome.reason)

    def _fail(self, goal: MotionGoal, error: Exception) -> FollowJointTrajectory.Result:
        if goal.failure is not None:
            outcome = refused(error)
            return self._result(outcome.code, outcome.reason)
        reason = f'how it ended is not known: {type(error).__name__}: {error}'
        return self._result(GoalCode.INVALID_GOAL, reason)

    def _result(self, code: GoalCode, reason: str) -> FollowJointTrajectory.Result:
        if code is not GoalCode.SUCCESSFUL:
            self._node.get_logger().warning(f'goal ended with {code.name}: {reason}')
        return FollowJointTrajectory.Result(error_code=int(code), error_string=reason)
