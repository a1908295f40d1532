# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The actions of move_group: execute_trajectory, move_action and sequence_move_group."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import dataclass
from typing import Any

from moveit_msgs.action import ExecuteTrajectory, MoveGroup, MoveGroupSequence
from moveit_msgs.msg import MoveItErrorCodes, RobotState
from rclpy.node import Node
from rclpy.timer import Timer
from std_msgs.msg import String

from node_runner.action_goals import Ending, GoalServer, ServedGoal

from ..exceptions import PlanningCode, PlanningError
from ..planner import CANCELED
from .background import as_refusal, Background, error_code
from .execution import Execution, INVALIDATED, TrajectoryExecution
from .planning import PlannedMotion, PlanningThreads, sequence_group, sequence_response

STOP = 'stop'  # the event that stops everything
STOPPED = 'everything was stopped meanwhile'
REPLAN_ATTEMPTS = 5  # how often a goal that does not say so is planned anew at most, as in MoveIt
STATE_WAITS, STATE_PERIOD = 10, 0.1
"""Number of retries, and time between two in [s], while joint states are missing or too old, or
the arm still moves after a jog; MoveIt also waits for states for a second."""

Prepare = Callable[[Any, bool, Callable[[], bool]], Callable[[], PlannedMotion]]
Answer = Callable[[MoveItErrorCodes, PlannedMotion | None, bool], Any]


@dataclass(slots=True, eq=False)
class _Goal(ServedGoal):
    """An action goal from its request to its result."""

    stops: int  # how often everything was stopped before its request
    execution: Execution | None = None
    outcome: tuple[PlanningCode, str] = (PlanningCode.SUCCESS, '')


class ExecuteAction:
    """Executes trajectories that clients have planned."""

    def __init__(self, node: Node, execution: TrajectoryExecution) -> None:
        self._node, self._execution = node, execution
        self._server = GoalServer(
            node,
            ExecuteTrajectory,
            'execute_trajectory',
            accept=lambda: _Goal(execution.stops),
            start=self._start,
            cancel=self._cancel,
            conclude=self._conclude,
            fail=self._fail,
            refusals=(PlanningError,),
        )
        node.create_subscription(String, 'trajectory_execution_event', self._event, 10)

    def _start(self, goal: _Goal) -> None:
        def done(code: PlanningCode, reason: str) -> None:
            goal.outcome = code, reason
            self._server.end(goal)

        if goal.stops != self._execution.stops:
            done(PlanningCode.PREEMPTED, STOPPED)
            return
        asked = goal.handle.request
        goal.execution = self._execution.start(
            asked.trajectory.joint_trajectory, done, list(asked.controller_names)
        )
        goal.handle.publish_feedback(ExecuteTrajectory.Feedback(state='MONITOR'))

    def _cancel(self, goal: _Goal) -> None:
        if goal.execution is not None:
            self._execution.stop(goal.execution, reason='canceled')

    def _conclude(self, goal: _Goal) -> tuple[Ending, ExecuteTrajectory.Result]:
        goal.handle.publish_feedback(ExecuteTrajectory.Feedback(state='IDLE'))
        ending, code = _ending(self._node, 'execute_trajectory', goal)
        return ending, ExecuteTrajectory.Result(error_code=code)

    def _fail(self, goal: _Goal, error: Exception) -> ExecuteTrajectory.Result:
        code = _failure(self._node, 'execute_trajectory', goal, error)
        return ExecuteTrajectory.Result(error_code=code)

    def _event(self, message: String) -> None:
        if message.data == STOP:
            self._execution.stop_all('stopped by trajectory_execution_event')
            return
        self._node.get_logger().warning(
            f'trajectory_execution_event: unknown event {message.data!r}; there is {STOP!r}'
        )


@dataclass(frozen=True, slots=True)
class MotionKind:
    """How one kind of action reads its goals and fills in its results."""

    action: Any  # its class
    name: str  # its name
    # takes what a goal asks for, whether it is planned anew, and what says that it is canceled;
    # returns what plans it in the thread of its group; raises PlanningError
    prepare: Prepare
    group: Callable[[Any], str]  # returns the group of what a goal asks for
    answer: Answer  # makes the result of how it ended, the plan, and whether that was begun


def single_motion(planning: PlanningThreads, warn: Callable[[str], object]) -> MotionKind:
    """Return move_action: a motion of MoveGroupInterface::plan and ::move."""

    def prepare(
        asked: Any,  # noqa: ANN401
        again: bool,
        is_canceled: Callable[[], bool],
    ) -> Callable[[], PlannedMotion]:
        if again or not asked.planning_options.plan_only:  # from where it is, as in MoveIt
            given = asked.request.start_state
            if given.joint_state.name or given.multi_dof_joint_state.joint_names:
                warn(
                    'move_action: a motion is executed from where the robot is: the start_state of'
                    ' the request is ignored; plan from it with plan_only'
                )
            asked.request.start_state = RobotState(is_diff=True)
        diff = asked.planning_options.planning_scene_diff
        return planning.prepare(asked.request, diff, is_canceled)

    def group(asked: Any) -> str:  # noqa: ANN401
        return str(asked.request.group_name)

    def answer(code: MoveItErrorCodes, planned: PlannedMotion | None, begun: bool) -> Any:  # noqa: ANN401
        result = MoveGroup.Result(error_code=code)
        if planned is not None:
            result.trajectory_start = planned.start
            (result.planned_trajectory,) = planned.trajectories
            result.planning_time = planned.planning_time
            if begun:
                result.executed_trajectory = result.planned_trajectory
        return result

    return MotionKind(MoveGroup, 'move_action', prepare, group, answer)


def sequence(planning: PlanningThreads) -> MotionKind:
    """Return sequence_move_group, as in Pilz' planner."""

    def prepare(
        asked: Any,  # noqa: ANN401
        _: bool,
        is_canceled: Callable[[], bool],
    ) -> Callable[[], PlannedMotion]:
        if asked.planning_options.replan:
            raise PlanningError(
                PlanningCode.PLANNING_FAILED,
                'planning_options.replan: a sequence is not planned anew; leave it out',
            )
        diff = asked.planning_options.planning_scene_diff
        return planning.prepare_sequence(asked.request.items, diff, is_canceled)

    def group(asked: Any) -> str:  # noqa: ANN401
        return sequence_group(asked.request.items)

    def answer(code: MoveItErrorCodes, planned: PlannedMotion | None, _: bool) -> Any:  # noqa: ANN401
        return MoveGroupSequence.Result(response=sequence_response(code, planned))

    return MotionKind(MoveGroupSequence, 'sequence_move_group', prepare, group, answer)


@dataclass(slots=True, eq=False)
class _MotionGoal(_Goal):
    """A goal whose plan is executed, and why it was stopped before replanning."""

    work: Future[Any] | None = None
    planned: PlannedMotion | None = None
    begun: int = 0
    is_canceled: bool = False
    replans: int = 0
    stop: str = ''
    state_waits: int = 0
    delay: Timer | None = None


class MotionAction:
    """Plans in the thread of a group; executes in parallel with goals of other joints."""

    def __init__(
        self,
        node: Node,
        kind: MotionKind,
        planning: PlanningThreads,
        background: Background,
        execution: TrajectoryExecution,
    ) -> None:
        self._node, self._kind, self._planning = node, kind, planning
        self._background, self._execution = background, execution
        self._server = GoalServer(
            node,
            kind.action,
            kind.name,
            accept=lambda: _MotionGoal(execution.stops),
            start=self._begin_planning,
            cancel=self._cancel,
            conclude=self._conclude,
            fail=self._fail,
        )

    def _begin_planning(self, goal: _MotionGoal) -> None:
        goal.state_waits = 0
        self._publish(goal, 'PLANNING')
        self._plan(goal)

    def _plan(self, goal: _MotionGoal) -> None:
        executes = not goal.handle.request.planning_options.plan_only
        lane = self._kind.group(goal.handle.request)
        if executes and goal.state_waits < STATE_WAITS and self._planning.is_moving(lane):
            goal.state_waits += 1
            self._after(goal, STATE_PERIOD, self._plan)
            return
        try:
            work = self._kind.prepare(
                goal.handle.request, goal.replans > 0, lambda: goal.is_canceled
            )
        except Exception as error:  # noqa: BLE001  # a goal must not end the program
            refusal = as_refusal(error)
            is_stale = refusal.code is PlanningCode.ROBOT_STATE_STALE
            if is_stale and goal.state_waits < STATE_WAITS:
                goal.state_waits += 1
                self._after(goal, STATE_PERIOD, self._plan)
            else:
                self._refuse(goal, refusal)
            return
        goal.work = self._background.submit(work, lambda done: self._planned(goal, done), lane)

    def _refuse(self, goal: _MotionGoal, refusal: PlanningError) -> None:
        """End a goal for which planning failed; its motion, if any, has stopped already."""
        before = f'; the arm was stopped on its way: {goal.stop}' if goal.stop else ''
        self._end(goal, refusal.code, f'{refusal}{before}')

    def _planned(self, goal: _MotionGoal, done: Future[Any]) -> None:
        if goal.is_canceled or done.cancelled():
            self._end(goal, PlanningCode.PREEMPTED, CANCELED)
            return
        error = done.exception()
        if error is not None:
            self._refuse(goal, as_refusal(error))
            return
        planned = goal.planned = done.result()
        self._planning.display(planned)
        if goal.handle.request.planning_options.plan_only:
            self._end(goal, PlanningCode.SUCCESS, '; '.join(planned.notes))
            return
        self._publish(goal, 'MONITOR')
        self._follow(goal, planned)

    def _follow(self, goal: _MotionGoal, planned: PlannedMotion) -> None:
        """Execute the next trajectory of a plan, or end the goal after the last."""
        if goal.stops != self._execution.stops:
            self._end(goal, PlanningCode.PREEMPTED, STOPPED)
            return
        if goal.begun == len(planned.trajectories):
            self._end(goal, PlanningCode.SUCCESS, '; '.join(planned.notes))
            return
        try:
            goal.execution = self._execution.start(
                planned.trajectories[goal.begun].joint_trajectory,
                lambda code, reason: self._executed(goal, code, reason),
            )
        except Exception as error:  # noqa: BLE001  # a goal must not end the program
            refusal = as_refusal(error)
            self._end(goal, refusal.code, str(refusal))
        else:
            goal.begun += 1

    def _executed(self, goal: _MotionGoal, code: PlanningCode, reason: str) -> None:
        """Continue, end, or replan if the scene has changed and the options request it."""
        if code is PlanningCode.SUCCESS and goal.planned is not None:
            if goal.is_canceled and goal.begun < len(goal.planned.trajectories):
                self._end(goal, PlanningCode.PREEMPTED, 'canceled')
            else:
                self._follow(goal, goal.planned)
            return
        options = goal.handle.request.planning_options
        most = options.replan_attempts if options.replan_attempts > 0 else REPLAN_ATTEMPTS
        if code is not INVALIDATED or not options.replan or goal.is_canceled:
            self._end(goal, code, reason)
            return
        if goal.replans >= most:
            self._end(goal, code, f'{reason}; planned anew {most} times')
            return
        self._node.get_logger().info(f'{self._kind.name}: {reason}; plans anew')
        goal.replans, goal.begun, goal.stop = goal.replans + 1, 0, reason
        goal.execution = goal.work = goal.planned = None
        self._after(goal, max(options.replan_delay, 0.0), self._begin_planning)

    def _after(self, goal: _MotionGoal, delay: float, plan: Callable[[_MotionGoal], None]) -> None:
        """Continue with a goal later, unless it is canceled."""

        def go_on() -> None:
            if goal.delay is not timer:
                return  # an executor calls a timer for each expiry until it was destroyed
            self._end_delay(goal)
            plan(goal)

        timer = goal.delay = self._node.create_timer(delay, go_on)

    def _end_delay(self, goal: _MotionGoal) -> None:
        if goal.delay is not None:
            self._node.destroy_timer(goal.delay)
            goal.delay = None

    def _cancel(self, goal: _MotionGoal) -> None:
        goal.is_canceled = True
        if goal.execution is not None:
            self._execution.stop(goal.execution, reason='canceled')
        elif goal.work is not None:
            goal.work.cancel()
        elif goal.delay is not None:
            self._end_delay(goal)
            self._end(goal, PlanningCode.PREEMPTED, 'canceled before it was planned')

    def _end(self, goal: _MotionGoal, code: PlanningCode, reason: str) -> None:
        goal.outcome = code, reason
        self._server.end(goal)

    def _conclude(self, goal: _MotionGoal) -> tuple[Ending, Any]:
        self._publish(goal, 'IDLE')
        ending, code = _ending(self._node, self._kind.name, goal)
        execution = goal.execution
        is_begun = goal.begun > 1 or (execution is not None and execution.is_sent)
        return ending, self._kind.answer(code, goal.planned, is_begun)

    def _fail(self, goal: _MotionGoal, error: Exception) -> Any:  # noqa: ANN401
        code = _failure(self._node, self._kind.name, goal, error)
        return self._kind.answer(code, None, False)

    def _publish(self, goal: _MotionGoal, state: str) -> None:
        goal.handle.publish_feedback(self._kind.action.Feedback(state=state))


def _ending(node: Node, name: str, goal: _Goal) -> tuple[Ending, MoveItErrorCodes]:
    """Return MoveIt's status and error code of an ended goal, and log a failure."""
    code, reason = goal.outcome
    if code is not PlanningCode.SUCCESS:
        node.get_logger().warning(f'{name}: {code.name}: {reason}')
    endings = {
        PlanningCode.SUCCESS: Ending.SUCCEEDED,
        PlanningCode.PREEMPTED: Ending.CANCELED,
    }
    return endings.get(code, Ending.ABORTED), error_code(code, reason)


def _failure(node: Node, name: str, goal: _Goal, error: Exception) -> MoveItErrorCodes:
    """Return the error code of a goal that could not begin or be answered."""
    refusal = as_refusal(error)
    goal.outcome = refusal.code, str(refusal)
    return _ending(node, name, goal)[1]
