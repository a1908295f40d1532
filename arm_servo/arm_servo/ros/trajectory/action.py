# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The action FollowJointTrajectory: every goal ends with a code and the reason."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
import time
import traceback
from typing import Any

from control_msgs.action import FollowJointTrajectory
from rclpy.action.server import CancelResponse
from rclpy.node import Node

from arm_model import ArmError
from arm_trajectory import GoalCode, TrajectoryGoal
from node_runner.action_goals import serve_goals

from ...controllers.controller import Outcome, refused
from ...controllers.trajectory import Execution
from ...core.gateway import CommandGateway
from ...core.motion_queue import MotionCommand
from .messages import difference, point_of

START_TIMEOUT = 5.0  # time in which a goal must be planned and taken by the cycle in [s]
START_TIMEOUT_PER_POINT = 0.01  # the same for each of its points in [s]

Follow = Callable[[TrajectoryGoal], MotionCommand]


@dataclass(slots=True)
class _Goal:
    """A goal from its acceptance to its end."""

    handle: Any
    command: MotionCommand | None = None  # None for a goal that is refused at once
    begin: float = field(default_factory=time.monotonic)
    outcome: Outcome | None = None
    is_concluded: bool = False

    @property
    def timeout(self) -> float:
        """Time in which it must have begun in [s]."""
        return START_TIMEOUT + START_TIMEOUT_PER_POINT * len(self.handle.request.trajectory.points)

    def ending(self) -> Outcome | None:
        """Return how it has ended; None while it goes on."""
        if self.command is None:
            return self.outcome
        return self.command.ended.result() if self.command.ended.done() else None


class TrajectoryAction:
    """The action server.

    rclpy runs a goal in a callback or coroutine, which would keep the executor from everything
    else; here a timer watches the executions of the core. A goal that cannot be followed is
    accepted and aborted at once, since a rejection could carry neither code nor reason.
    """

    def __init__(
        self,
        node: Node,
        gateway: CommandGateway,
        rate: float,
        convert: Callable[[Any], TrajectoryGoal],
        follow: Follow,
    ) -> None:
        """Offer ``~/follow_joint_trajectory``.

        Args:
            convert: Makes a trajectory of a goal; raises GoalError.
        """
        self._node = node
        self._gateway = gateway
        self._convert = convert
        self._follow = follow
        self._goals: dict[bytes, _Goal] = {}
        self._server = serve_goals(
            node,
            FollowJointTrajectory,
            '~/follow_joint_trajectory',
            start=self._start,
            conclude=self._conclude,
            cancel=self._cancel,
        )
        node.create_timer(1.0 / rate, self._watch)

    def _start(self, handle: Any) -> None:  # noqa: ANN401  # rclpy has no types here
        goal = self._goals[bytes(handle.goal_id.uuid)] = _Goal(handle)
        try:
            goal.command = self._follow(self._convert(handle.request))
        except ArmError as error:
            goal.outcome = refused(error)
        except Exception as error:  # noqa: BLE001  # a goal must not end the program
            goal.outcome = refused(error)
            self._node.get_logger().error(traceback.format_exc())

    def _cancel(self, handle: Any) -> CancelResponse:  # noqa: ANN401
        goal = self._goals.get(bytes(handle.goal_id.uuid))
        if goal is not None and goal.command is not None:
            self._gateway.cancel(goal.command, 'canceled: at rest on the path')
        return CancelResponse.ACCEPT

    def _watch(self) -> None:
        for goal in list(self._goals.values()):
            if goal.is_concluded:
                continue
            goal.outcome = goal.ending() or self._overdue(goal)
            if goal.outcome is not None:
                goal.is_concluded = True
                self._server.notify_execute(goal.handle, None)  # leads to _conclude
            elif goal.command is not None and goal.command.execution is not None:
                self._publish_feedback(goal.handle, goal.command.execution)

    def _overdue(self, goal: _Goal) -> Outcome | None:
        """End a goal that the cycle does not begin with."""
        waits = goal.command is not None and goal.command.execution is None
        if goal.command is None or not waits or time.monotonic() - goal.begin <= goal.timeout:
            return None
        reason = 'the cycle does not run; is the bus up?'
        self._gateway.cancel(goal.command, reason)
        return Outcome(GoalCode.INVALID_GOAL, reason)

    def _publish_feedback(self, handle: Any, execution: Execution) -> None:  # noqa: ANN401
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

    def _conclude(self, handle: Any) -> FollowJointTrajectory.Result:  # noqa: ANN401
        outcome = self._goals.pop(bytes(handle.goal_id.uuid)).outcome
        if outcome is None:  # cannot be: only _watch calls for the end
            outcome = Outcome(GoalCode.INVALID_GOAL, 'ended without an outcome')
        code = outcome.code
        if outcome.canceled and handle.is_cancel_requested:
            handle.canceled()
        elif code is GoalCode.SUCCESSFUL and not outcome.canceled:
            handle.succeed()
        else:
            code = GoalCode.INVALID_GOAL if outcome.canceled else code
            handle.abort()
        if code is not GoalCode.SUCCESSFUL:
            self._node.get_logger().warning(f'goal ended with {code.name}: {outcome.reason}')
        return FollowJointTrajectory.Result(error_code=int(code), error_string=outcome.reason)
