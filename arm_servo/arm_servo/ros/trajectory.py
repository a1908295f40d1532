# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Topics, services and action of the trajectory controller.

Every result of FollowJointTrajectory has a code and a reason.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from concurrent.futures import Future
from dataclasses import replace
from functools import partial
import time
import traceback
from typing import Any

from control_msgs.action import FollowJointTrajectory
from control_msgs.msg import JointTrajectoryControllerState, SpeedScalingFactor
from control_msgs.srv import QueryTrajectoryState
from rclpy.duration import Duration
from rclpy.event_handler import SubscriptionEventCallbacks
from rclpy.node import Node
from std_srvs.srv import Trigger
from trajectory_msgs.msg import JointTrajectory

from arm_model import ArmError
from arm_model.ros import seconds
from arm_trajectory import GoalCode
from node_runner import LATCHED
from node_runner.action_goals import Ending

from ..controllers.controller import NotReadyError, Outcome, refused, Source
from ..controllers.trajectory import Execution
from ..core.gateway import CommandGateway, MotionCommand
from ..core.requests import PauseRequest, Snapshot, SpeedRequest, StopRequest
from .motion_goals import LoggedReasons, MotionGoal, MotionGoals, START_TIMEOUT
from .trajectory_goals import (
    difference,
    goal_of_action,
    goal_of_trajectory,
    point_of,
    TrajectoryParameters,
)

START_TIMEOUT_PER_POINT = 0.01  # time to plan each point of a goal in [s]


class TrajectoryAction:
    """Action server of FollowJointTrajectory."""

    def __init__(
        self,
        node: Node,
        gateway: CommandGateway,
        rate: float,  # rate of the feedback in [Hz]
        # requests the trajectory of a goal message with its number; raises an ArmError
        follow: Callable[[Any, int], MotionCommand],
        rest_speed: float,  # above which a joint moves in [rad/s] or [m/s]
    ) -> None:
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
            rest_speed=rest_speed,
        )
        node.create_timer(1.0 / rate, lambda: self._goals.watch(self._look))

    def _look(self, goal: MotionGoal) -> None:
        count = len(goal.handle.request.trajectory.points)
        timeout = START_TIMEOUT + START_TIMEOUT_PER_POINT * count
        goal.outcome = self._goals.outcome(goal, timeout)
        if goal.outcome is not None:
            if not goal.outcome.canceled or self._goals.has_stopped(goal):
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
        return ending, self._result(code, outcome.reason + goal.unrest)

    def _fail(self, goal: MotionGoal, error: Exception) -> FollowJointTrajectory.Result:
        if goal.failure is not None:
            outcome = refused(error)
            return self._result(outcome.code, outcome.reason + goal.unrest)
        reason = f'how it ended is not known: {type(error).__name__}: {error}'
        return self._result(GoalCode.INVALID_GOAL, reason)

    def _result(self, code: GoalCode, reason: str) -> FollowJointTrajectory.Result:
        if code is not GoalCode.SUCCESSFUL:
            self._node.get_logger().warning(f'goal ended with {code.name}: {reason}')
        return FollowJointTrajectory.Result(error_code=int(code), error_string=reason)


TOPIC = 'joint_trajectory'  # identifies all its publishers, whose names are unknown

SOURCE_WORDS = {
    Source.TRAJECTORY: 'the trajectory',
    Source.TARGET: 'the single target',
    Source.JOG: 'the jog',
}


class TrajectoryPause:
    """Pauses and resumes all motion of the arm."""

    def __init__(self, node: Node, gateway: CommandGateway) -> None:
        self._gateway = gateway
        self._paused = False  # as it was ordered: the cycle may not have come to it yet
        node.create_service(Trigger, '~/pause', partial(self._order, True, words_of_pause))
        node.create_service(Trigger, '~/resume', partial(self._order, False, words_of_resume))

    def _order(
        self,
        paused: bool,
        words: Callable[[Snapshot], str],
        _: Trigger.Request,
        response: Trigger.Response,
    ) -> Trigger.Response:
        snapshot = self._gateway.snapshot
        response.message = snapshot.stale(time.monotonic() - snapshot.time)
        if response.message:
            return response
        self._gateway.command(PauseRequest(paused))
        response.success, response.message = True, words(replace(snapshot, paused=self._paused))
        self._paused = paused
        return response


def words_of_pause(snapshot: Snapshot) -> str:
    """Describe the effect of a pause."""
    if snapshot.paused:
        return 'is paused already; ~/resume goes on'
    if snapshot.source is Source.NONE:
        return 'paused; nothing is under way, and trajectories wait for ~/resume'
    if snapshot.source is Source.JOG:
        return 'paused; the jog ends, and trajectories wait for ~/resume'
    return f'paused; {SOURCE_WORDS[snapshot.source]} comes to rest on its path until ~/resume'


def words_of_resume(snapshot: Snapshot) -> str:
    """Describe the motion that resumes after a pause."""
    if not snapshot.paused:
        return 'was not paused'
    if snapshot.speed == 0.0:
        return 'no longer paused, but the speed override is 0; see ~/speed_scaling_input'
    if snapshot.source is Source.NONE:
        return 'takes commands again; nothing is under way'
    return f'{SOURCE_WORDS[snapshot.source]} goes on'


class TrajectoryController:
    """``~/follow_joint_trajectory``, ``~/joint_trajectory`` and their services."""

    def __init__(
        self,
        node: Node,
        gateway: CommandGateway,
        parameters: TrajectoryParameters,
        sources: tuple[Source, ...] = (Source.TRAJECTORY,),  # what ends when it is deactivated
    ) -> None:
        self.active = True
        self._node, self._gateway, self._sources = node, gateway, sources
        self._news: deque[str] = deque()
        self._logged = LoggedReasons()
        self._state = node.create_publisher(
            JointTrajectoryControllerState, '~/controller_state', 10
        )
        node.create_subscription(JointTrajectory, '~/joint_trajectory', self._take, 10)
        # who publishes it once from a shell does not latch it: that no value comes from such a
        # publisher by the latched subscription is no news, as the other one gets it
        silent = SubscriptionEventCallbacks(use_default_callbacks=False)
        for qos in (LATCHED, 1):
            node.create_subscription(
                SpeedScalingFactor,
                '~/speed_scaling_input',
                self._scale,
                qos,
                event_callbacks=silent,
            )
        node.create_service(QueryTrajectoryState, '~/query_state', self._query)
        TrajectoryPause(node, gateway)
        node.create_timer(1.0 / parameters.state_rate, self._publish_state)
        self._action = TrajectoryAction(
            node, gateway, parameters.monitor_rate, self._follow, parameters.rest_speed
        )
        if parameters.speed != 1.0:
            self._override(parameters.speed)

    def set_active(self, active: bool) -> None:  # a callback of the manager
        """Accept trajectories; if inactive, stop on the path and refuse them."""
        self.active = active
        if active:
            self._gateway.renew(Source.TRAJECTORY)
        else:
            self._gateway.command(StopRequest('the controller was deactivated', self._sources))

    @property
    def _now(self) -> float:
        return float(self._node.get_clock().now().nanoseconds) * 1e-9

    def _follow(self, request: Any, number: int) -> MotionCommand:  # noqa: ANN401  # goals have no type
        goal = goal_of_action(request, self._now)
        self.check_active()
        return self._gateway.request(goal, number)

    def check_active(self) -> None:
        """Check that the controller is active.

        Raises:
            NotReadyError: The controller was deactivated.
        """
        if not self.active:
            name = self._node.get_name()
            raise NotReadyError(f'{name} is inactive; activate it with switch_controller')

    def _take(self, message: JointTrajectory) -> None:
        if not message.joint_names and not message.points:
            self._gateway.command(StopRequest('an empty trajectory came', (Source.TRAJECTORY,)))
            self._gateway.renew(Source.TRAJECTORY)
            return
        try:
            self._gateway.stream(Source.TRAJECTORY, TOPIC)
            goal = goal_of_trajectory(message, self._now)
            self.check_active()
            command = self._gateway.request(goal, stream=TOPIC)
        except ArmError as error:
            self._news.append(f'trajectory refused: {error}')
            return
        except Exception:  # noqa: BLE001  # a message must not end the program
            self._node.get_logger().error(f'trajectory refused: {traceback.format_exc()}')
            return
        command.future.add_done_callback(self._log_refusal)

    def _scale(self, message: SpeedScalingFactor) -> None:
        self._override(message.factor)

    def _override(self, speed: float) -> None:
        self._gateway.command(SpeedRequest(speed)).add_done_callback(self._log_refusal)

    def _log_refusal(self, future: Future[Any]) -> None:
        if not future.cancelled() and (error := future.exception()) is not None:
            self._news.append(f'refused: {error}')  # the cycle must not wait for a log

    def _query(
        self, request: QueryTrajectoryState.Request, response: QueryTrajectoryState.Response
    ) -> QueryTrajectoryState.Response:
        snapshot = self._gateway.snapshot
        state = snapshot.reference
        response.message = snapshot.stale(time.monotonic() - snapshot.time)
        if state is None or response.message:
            response.message = response.message or snapshot.blocked
            return response
        ahead = seconds(request.time) - self._now if seconds(request.time) else 0.0
        if snapshot.source is Source.TRAJECTORY and snapshot.execution is not None:
            state = snapshot.execution.foreseen(ahead)
        response.success = True
        response.message = 'paused; ~/resume goes on' if snapshot.paused else ''
        response.name = list(self._gateway.model.joints)
        response.position = state.position.tolist()
        response.velocity = state.velocity.tolist()
        response.acceleration = state.acceleration.tolist()
        return response

    def _publish_state(self) -> None:
        while self._news:
            reason = self._news.popleft()
            if self._logged.is_new(reason, time.monotonic()):
                self._node.get_logger().warning(reason)
        if not self._state.get_subscription_count():  # publishing takes a tenth of a processor
            return
        snapshot = self._gateway.snapshot
        wanted, measured = snapshot.reference, snapshot.measured
        if wanted is None or measured is None:
            return
        message = JointTrajectoryControllerState(
            joint_names=list(self._gateway.model.joints),
            reference=point_of(wanted),
            feedback=point_of(measured),
            error=point_of(difference(self._gateway.model.limits, wanted, measured)),
            output=point_of(wanted),
            speed_scaling_factor=snapshot.speed_scaling,
        )
        age = Duration(nanoseconds=round((time.monotonic() - snapshot.time) * 1e9))
        message.header.stamp = (self._node.get_clock().now() - age).to_msg()  # that of the cycle
        self._state.publish(message)
