# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The action FollowJointTrajectory: every goal ends with a code and the reason."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass, field
import time
from typing import Any

from control_msgs.action import FollowJointTrajectory
from rclpy.action.server import ActionServer, CancelResponse
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node

from ..core import MotionCore
from ..exceptions import GoalCode, GoalError, ServoError
from ..execution import Execution, Outcome, Phase
from ..goal import TrajectoryGoal
from .desk import Desk
from .trajectory_messages import difference, point_of

PATIENCE = 5.0
"""Time in which a goal must be planned and taken by the cycle in [s]."""

PER_POINT = 0.01
"""The same for each of its points in [s]."""

Follow = Callable[[TrajectoryGoal], Future[Execution]]


@dataclass(slots=True)
class _Goal:
    """A goal from its acceptance to its end."""

    handle: Any
    future: Future[Execution]
    patience: float
    begin: float = field(default_factory=time.monotonic)
    outcome: Outcome | None = None

    def ending(self) -> Outcome | None:
        """Return how it has ended; None while it goes on."""
        if self.future.cancelled():
            return Outcome(GoalCode.SUCCESSFUL, 'canceled before it began', canceled=True)
        if not self.future.done():
            late = time.monotonic() - self.begin > self.patience
            if late and self.future.cancel():
                return Outcome(GoalCode.INVALID_GOAL, 'the cycle does not run; is the bus up?')
            return None
        error = self.future.exception()
        if error is not None:
            code = error.code if isinstance(error, GoalError) else GoalCode.INVALID_GOAL
            return Outcome(code, str(error))
        execution = self.future.result()
        return execution.ending if execution.phase is Phase.DONE else None


class TrajectoryAction:
    """The action server.

    rclpy runs a goal in a callback or coroutine, which would keep the executor from everything
    else; here a timer watches the executions of the core. A goal that cannot be followed is
    accepted and aborted at once, since a rejection could carry neither code nor reason.
    """

    def __init__(
        self,
        node: Node,
        desk: Desk,
        rate: float,
        convert: Callable[[Any], TrajectoryGoal],
        follow: Follow,
    ) -> None:
        """Offer ``~/follow_joint_trajectory``.

        Args:
            node: The controller's node.
            desk: The core's desk.
            rate: Rate of the feedback in [Hz].
            convert: Makes a trajectory of a goal; raises GoalError.
            follow: Has a trajectory followed.
        """
        self._node = node
        self._desk = desk
        self._convert = convert
        self._follow = follow
        self._goals: dict[bytes, _Goal] = {}
        self._server = ActionServer(
            node,
            FollowJointTrajectory,
            '~/follow_joint_trajectory',
            execute_callback=self._conclude,
            handle_accepted_callback=self._start,
            cancel_callback=self._cancel,
        )
        node.create_timer(1.0 / rate, self._watch)

    def _start(self, handle: Any) -> None:  # noqa: ANN401  # rclpy has no types here
        # handle.execute() would end the goal when its callback returns, which is now
        handle._update_state(rclpy_implementation.GoalEvent.EXECUTE)  # noqa: SLF001
        try:
            future = self._follow(self._convert(handle.request))
        except ServoError as error:
            future = Future()
            future.set_exception(error)
        self._goals[bytes(handle.goal_id.uuid)] = _Goal(
            handle, future, PATIENCE + PER_POINT * len(handle.request.trajectory.points)
        )

    def _cancel(self, handle: Any) -> CancelResponse:  # noqa: ANN401
        goal = self._goals.get(bytes(handle.goal_id.uuid))

        if goal is not None and goal.future.cancel():
            return CancelResponse.ACCEPT  # it has not begun

        def stop(_core: MotionCore, _now: float) -> None:
            if goal is not None and goal.future.done() and goal.future.exception() is None:
                outcome = Outcome(GoalCode.SUCCESSFUL, 'canceled: at rest on the path', True)
                goal.future.result().stop(outcome)

        self._desk.submit(stop, moves=False)
        return CancelResponse.ACCEPT

    def _watch(self) -> None:
        for goal in list(self._goals.values()):
            if goal.outcome is not None:
                continue
            goal.outcome = goal.ending()
            if goal.outcome is not None:
                self._server.notify_execute(goal.handle, None)  # leads to _conclude
            elif goal.future.done():
                self._publish_feedback(goal)

    def _publish_feedback(self, goal: _Goal) -> None:
        state = goal.future.result().feedback
        feedback = FollowJointTrajectory.Feedback(
            joint_names=list(self._desk.model.joints),
            desired=point_of(state.desired, state.time),
            actual=point_of(state.actual, state.time),
            error=point_of(difference(state.desired, state.actual), state.time),
        )
        feedback.header.stamp = self._node.get_clock().now().to_msg()
        goal.handle.publish_feedback(feedback)

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
