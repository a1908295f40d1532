# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The action move_action: plan, and execute unless only a plan is asked for."""

from __future__ import annotations

from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from moveit_msgs.action import MoveGroup
from moveit_msgs.msg import RobotState
from rclpy.action.server import CancelResponse
from rclpy.node import Node
from rclpy.timer import Timer

from node_runner.action_goals import serve_goals

from ..exceptions import PlanningCode, PlanningError
from .background import as_refusal, Background, error_code
from .execute_action import conclude
from .execution import Execution, INVALIDATED, TrajectoryExecution
from .planning import PlannedMotion, PlanningThread

REPLAN_ATTEMPTS = 5
"""How often a goal that does not say so is planned anew at most, as in MoveIt."""


@dataclass(slots=True, eq=False)
class _Goal:
    """A goal from its acceptance to its end."""

    handle: Any
    work: Future[Any] | None = None
    planned: PlannedMotion | None = None
    execution: Execution | None = None
    outcome: tuple[PlanningCode, str] = (PlanningCode.SUCCESS, '')
    is_canceled: bool = False
    replans: int = 0
    delay: Timer | None = None


class MoveAction:
    """Plans in the thread of planning; executes beside other goals whose joints are others."""

    def __init__(
        self,
        node: Node,
        planning: PlanningThread,
        background: Background,
        execution: TrajectoryExecution,
    ) -> None:
        """Offer it.

        Args:
            node: The node.
            planning: What plans.
            background: The thread of planning.
            execution: What executes.
        """
        self._node, self._planning = node, planning
        self._background, self._execution = background, execution
        self._goals: dict[bytes, _Goal] = {}
        self._server = serve_goals(
            node,
            MoveGroup,
            'move_action',
            start=self._start,
            conclude=self._conclude,
            cancel=self._cancel,
        )

    def _start(self, handle: Any) -> None:  # noqa: ANN401  # rclpy has no types here
        goal = self._goals[bytes(handle.goal_id.uuid)] = _Goal(handle)
        self._plan(goal)

    def _plan(self, goal: _Goal) -> None:
        request = goal.handle.request.request
        options = goal.handle.request.planning_options
        goal.handle.publish_feedback(MoveGroup.Feedback(state='PLANNING'))
        if goal.replans:  # from where it has stopped
            request.start_state = RobotState(is_diff=True)
        try:
            work = self._planning.prepare(request, options.planning_scene_diff)
        except PlanningError as error:
            self._end(goal, error.code, str(error))
            return
        goal.work = self._background.submit(work, lambda done: self._planned(goal, done))

    def _planned(self, goal: _Goal, done: Future[Any]) -> None:
        if goal.is_canceled or done.cancelled():
            self._end(goal, PlanningCode.PREEMPTED, 'canceled while it was planned')
            return
        error = done.exception()
        if error is not None:
            refusal = as_refusal(error)
            self._end(goal, refusal.code, str(refusal))
            return
        planned = goal.planned = done.result()
        self._planning.display(planned)
        if goal.handle.request.planning_options.plan_only:
            self._end(goal, PlanningCode.SUCCESS, '')
            return
        goal.handle.publish_feedback(MoveGroup.Feedback(state='MONITOR'))
        try:
            goal.execution = self._execution.start(
                planned.trajectory.joint_trajectory,
                lambda code, reason: self._executed(goal, code, reason),
            )
        except PlanningError as refused:
            self._end(goal, refused.code, str(refused))

    def _executed(self, goal: _Goal, code: PlanningCode, reason: str) -> None:
        """End it, or plan anew where the scene has changed and the goal's options say so."""
        options = goal.handle.request.planning_options
        most = options.replan_attempts if options.replan_attempts > 0 else REPLAN_ATTEMPTS
        if code is not INVALIDATED or not options.replan or goal.is_canceled:
            self._end(goal, code, reason)
            return
        if goal.replans >= most:
            self._end(goal, code, f'{reason}; planned anew {most} times')
            return
        self._node.get_logger().info(f'move_action: {reason}; plans anew')
        goal.replans, goal.execution, goal.work, goal.planned = goal.replans + 1, None, None, None

        def plan() -> None:
            self._end_delay(goal)
            self._plan(goal)

        goal.delay = self._node.create_timer(max(options.replan_delay, 0.0), plan)

    def _end_delay(self, goal: _Goal) -> None:
        if goal.delay is not None:
            self._node.destroy_timer(goal.delay)
            goal.delay = None

    def _cancel(self, handle: Any) -> CancelResponse:  # noqa: ANN401
        goal = self._goals.get(bytes(handle.goal_id.uuid))
        if goal is not None:
            goal.is_canceled = True
            if goal.execution is not None:
                self._execution.stop(goal.execution, reason='canceled')
            elif goal.work is not None:
                goal.work.cancel()
            elif goal.delay is not None:
                self._end_delay(goal)
                self._end(goal, PlanningCode.PREEMPTED, 'canceled before it was planned anew')
        return CancelResponse.ACCEPT

    def _end(self, goal: _Goal, code: PlanningCode, reason: str) -> None:
        goal.outcome = code, reason
        self._server.notify_execute(goal.handle, None)  # leads to _conclude

    def _conclude(self, handle: Any) -> MoveGroup.Result:  # noqa: ANN401
        goal = self._goals.pop(bytes(handle.goal_id.uuid))
        code, reason = goal.outcome
        handle.publish_feedback(MoveGroup.Feedback(state='IDLE'))
        if code is not PlanningCode.SUCCESS:
            self._node.get_logger().warning(f'move_action: {code.name}: {reason}')
        conclude(handle, code)
        result = MoveGroup.Result(error_code=error_code(code, reason))
        if goal.planned is not None:
            result.trajectory_start = goal.planned.start
            result.planned_trajectory = goal.planned.trajectory
            result.planning_time = goal.planned.planning_time
            if goal.execution is not None:
                result.executed_trajectory = goal.planned.trajectory
        return result
