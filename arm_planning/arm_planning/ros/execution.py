# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Execution of trajectories through the actions of the controllers.

Limits and codes are those of MoveIt's trajectory_execution_manager.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
import math
import time
from typing import Any

from action_msgs.msg import GoalStatus
from action_msgs.srv import CancelGoal
from control_msgs.msg import JointTrajectoryControllerState
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data
from rclpy.serialization import deserialize_message
from trajectory_msgs.msg import JointTrajectory

from arm_model.ros import seconds
from arm_trajectory import GoalCode
from node_runner import ServerMatch
from node_runner.action_goals import GoalClient

from ..exceptions import PlanningCode, PlanningError
from .parameters import Controller, ExecutionLimits, FOLLOW
from .trajectories import check_trajectory, from_start, part_of

WATCH_PERIOD = 0.05  # how often executions are looked at in [s]
MAX_WATCH_PERIOD = 0.2  # above it this process was held up; the rest counts for no limit in [s]
STOP_TIMEOUT = 5.0  # time in which controllers must have stopped in [s]; then they are asked again

FINDING_TIMEOUT = 5.0
"""Time-out for discovering the actions of controllers in [s]; discovery takes time after start."""

STATE_TIMEOUT = 1.0  # age at which the speed override of a controller counts no more in [s]

FORGOTTEN = (CancelGoal.Response.ERROR_UNKNOWN_GOAL_ID, CancelGoal.Response.ERROR_GOAL_TERMINATED)
"""Cancel responses of controllers that no longer follow the goal."""

INVALIDATED = PlanningCode.MOTION_PLAN_INVALIDATED_BY_ENVIRONMENT_CHANGE

Done = Callable[[PlanningCode, str], None]


@dataclass(slots=True, eq=False)
class Execution:
    """A trajectory under execution."""

    trajectory: Any  # the trajectory_msgs/JointTrajectory
    done: Done  # called once, with how it ended
    # steady time in [s] at which its controllers were asked
    begin: float = field(default_factory=time.monotonic)
    deadline: float = 0.0
    handles: dict[str, Any] = field(default_factory=dict)
    waits_for: set[str] = field(default_factory=set)
    ending: tuple[PlanningCode, str] | None = None
    is_over: bool = False  # whether ``done`` was called; a controller may still be on its way then
    # whether all controllers that have ended reached the end of the trajectory
    is_complete: bool = True
    in_doubt: bool = False  # whether it is still to be found out why a controller gave up
    # goals of its controllers that wait until the actions of all are found, by controller
    held: dict[str, Any] = field(default_factory=dict)
    is_sent: bool = False  # whether they were sent
    way: Any = None  # the trajectory with the way to its first point

    @property
    def joints(self) -> set[str]:
        """Names of the joints that it moves."""
        return set(self.trajectory.joint_names)


class TrajectoryExecution:
    """Sends trajectories to controllers and monitors them; runs in the node's executor."""

    def __init__(
        self,
        node: Node,
        controllers: Mapping[str, Controller],
        received: Callable[[Sequence[str]], Mapping[str, float]],
        limits: ExecutionLimits,
        *,
        followers: Collection[str] = (),
        continuous: Collection[str] = (),
    ) -> None:
        """Create clients of the controllers, whose actions may start later.

        Args:
            received: Returns joint positions in [rad], by joint; raises PlanningError if
                they are unknown.
            followers: Mimic joints, which no controller accepts.
        """
        self._followers, self._continuous = frozenset(followers), frozenset(continuous)
        self._node, self._controllers, self._received = node, controllers, received
        self._limits = limits
        self._clients = {
            name: GoalClient(node, each.kind.action, each.action(name))
            for name, each in controllers.items()
        }
        self._matches: dict[str, ServerMatch] = {}
        self._states: dict[str, tuple[float, bytes]] = {}
        self._references: dict[str, bytes] = {}
        self._moving: set[str] = set()
        self._timed = {name for name, each in controllers.items() if each.kind is FOLLOW}
        self._checked = {each for name in self._timed for each in controllers[name].joints}
        self._scaling: set[str] = set()
        for name in self._timed:
            node.create_subscription(
                JointTrajectoryControllerState,
                f'{name}/controller_state',
                partial(self._note_state, name),
                qos_profile_sensor_data,
                raw=True,  # of many only the latest is read, and only while something moves
            )
        self._watched = time.monotonic()
        self.stops = 0
        self._running: list[Execution] = []
        self.on_start: Callable[[], None] = lambda: None  # called when a trajectory begins
        # finds out why a controller gave up, and answers with :meth:`explain`
        self.on_failure: Callable[[Execution], None] | None = None
        node.create_timer(WATCH_PERIOD, self._watch)

    @property
    def running(self) -> Sequence[Execution]:
        """Executions under way that are not stopping."""
        return [each for each in self._running if each.ending is None]

    def explain(self, execution: Execution, change: str) -> None:
        """Store why a controller aborted: a change of the scene, or if empty its own message."""
        if not execution.in_doubt:
            return  # a client canceled it, or it took too long
        execution.in_doubt = False
        if change and execution.ending is not None:
            _, words = execution.ending
            execution.ending = INVALIDATED, f'{change}; {words}'
        self._conclude(execution)

    def start(
        self,
        trajectory: Any,  # noqa: ANN401  # messages have no type
        done: Done,
        names: Sequence[str] = (),
    ) -> Execution:
        """Execute a trajectory, as soon as the actions of its controllers are found.

        Args:
            done: Called once, when execution has ended or a controller was not found.
            names: Controllers that may be used; empty for all.

        Raises:
            PlanningError: The trajectory is invalid or does not start at the robot's state, no
                controller moves a joint, or another execution moves one of its joints.
        """
        if not self._limits.is_allowed:
            raise PlanningError(
                PlanningCode.CONTROL_FAILED,
                'Cannot execute trajectory since allow_trajectory_execution was set to false',
            )
        check_trajectory(trajectory)
        leading = [name for name in trajectory.joint_names if name not in self._followers]
        if 0 < len(leading) < len(trajectory.joint_names):
            trajectory = part_of(trajectory, leading)
        execution = Execution(trajectory, done)
        for other in self._running:
            if shared := other.joints & execution.joints:
                raise PlanningError(
                    PlanningCode.CONTROL_FAILED,
                    f'{_unconfirmed(other)}; wait, or restart it'
                    if other.is_over
                    else f'{min(shared)} is moved by another execution; stop it first, or wait',
                )
        self._check_start(execution)
        parts = self._parts(trajectory, names)
        execution.held = {name: self._controllers[name].goal(each) for name, each in parts.items()}
        execution.waits_for = set(parts)
        execution.deadline = execution.begin + FINDING_TIMEOUT
        self._running.append(execution)
        if not self._missing(execution):
            self._send(execution)
        return execution

    def _missing(self, execution: Execution) -> str:
        """Return the first controller whose action is not found; empty if all are found."""
        return next((name for name in execution.held if not self._is_found(name)), '')

    def _is_found(self, name: str) -> bool:
        """Whether the action of a controller exists, and its responses reach our client."""
        if not self._clients[name].server_is_ready():
            self._matches.pop(name, None)
            return False
        match = self._matches.get(name)
        if match is None:
            action = self._controllers[name].action(name)
            match = self._matches[name] = ServerMatch(self._node, [f'{action}/_action/send_goal'])
        return match.advance()

    def _send(self, execution: Execution) -> None:
        goals, execution.held, execution.is_sent = execution.held, {}, True
        lasts = seconds(execution.trajectory.points[-1].time_from_start)
        limits = self._limits
        execution.begin = time.monotonic()
        execution.deadline = (
            execution.begin + limits.duration_scaling * lasts + limits.duration_margin
            if limits.is_monitored
            else math.inf
        )
        for name, goal in goals.items():
            sent = self._clients[name].send_goal_async(goal)
            sent.add_done_callback(
                lambda answer, name=name: self._accepted(execution, name, answer)
            )
        self.on_start()

    def _look_again(self, execution: Execution) -> None:
        """Send a waiting trajectory once its controllers are found; refuse it after a time-out."""
        if missing := self._missing(execution):
            if time.monotonic() > execution.deadline:
                action = self._node.resolve_topic_name(self._controllers[missing].action(missing))
                reason = f'no action {action}; start the controller {missing}'
                self.stop(execution, PlanningCode.CONTROL_FAILED, reason)
            return
        try:
            self._check_start(execution)  # it may have moved meanwhile
        except PlanningError as error:
            self.stop(execution, error.code, str(error))
        else:
            self._send(execution)

    def stop(
        self,
        execution: Execution,
        code: PlanningCode = PlanningCode.PREEMPTED,
        reason: str = 'stopped on request',
    ) -> None:
        """Stop an execution; ``done`` is called when its controllers have stopped."""
        if execution.is_over:
            return
        if execution.ending is not None:
            if execution.in_doubt and code is PlanningCode.PREEMPTED:
                execution.in_doubt, execution.ending = False, (code, reason)
                self._conclude(execution)
            return
        execution.ending = code, reason
        if execution.held:  # no controller was asked
            execution.is_complete = False
            execution.held.clear()
            execution.waits_for.clear()
            self._conclude(execution)
            return
        execution.deadline = time.monotonic() + STOP_TIMEOUT
        for handle in execution.handles.values():
            handle.cancel_goal_async()

    def stop_all(self, reason: str) -> None:
        """Stop all executions, and increment :attr:`stops` so that no queued one follows."""
        self.stops += 1
        for execution in list(self._running):
            self.stop(execution, PlanningCode.PREEMPTED, reason)

    def _check_start(self, execution: Execution) -> None:
        """Refuse a start far from the present positions; else prepend the motion from there."""
        trajectory, tolerance = execution.trajectory, self._limits.start_tolerance
        places = dict(self._received(trajectory.joint_names))
        start = trajectory.points[0].positions
        for name, wanted in zip(trajectory.joint_names, start, strict=True):
            if name in self._continuous:  # in the turn in which the trajectory begins
                places[name] = wanted + math.remainder(places[name] - wanted, math.tau)
            # a gripper gets where it shall be alone, and may hold something by now
            if tolerance and name in self._checked and abs(places[name] - wanted) > tolerance:
                raise PlanningError(
                    PlanningCode.CONTROL_FAILED,
                    f'Invalid Trajectory: start point deviates from current robot state more than'
                    f' {tolerance:g} at joint {name!r}: it is at {places[name]:.4f}, the'
                    f' trajectory begins at {wanted:.4f}; plan anew',
                )
        execution.way = from_start(trajectory, [places[each] for each in trajectory.joint_names])

    def _parts(self, trajectory: Any, names: Sequence[str]) -> dict[str, JointTrajectory]:  # noqa: ANN401
        """Return the part of the trajectory for each controller."""
        if unknown := [name for name in names if name not in self._controllers]:
            raise PlanningError(
                PlanningCode.CONTROL_FAILED,
                f'no controller {unknown[0]!r}; controllers: {", ".join(self._controllers)}',
            )
        left = list(trajectory.joint_names)
        parts: dict[str, JointTrajectory] = {}
        for name in names or self._controllers:
            controller = self._controllers[name]
            joints = [joint for joint in left if joint in controller.joints]
            if not joints:
                continue
            left = [joint for joint in left if joint not in joints]
            parts[name] = part_of(trajectory, joints)
        if left:
            known = '; '.join(
                f'{name}: {", ".join(each.joints)}' for name, each in self._controllers.items()
            )
            raise PlanningError(
                PlanningCode.CONTROL_FAILED, f'no controller moves {left[0]}; there are {known}'
            )
        return parts

    def _accepted(self, execution: Execution, name: str, answer: Any) -> None:  # noqa: ANN401
        handle = answer.result()
        if not handle.accepted:
            execution.waits_for.discard(name)
            self._fail(execution, f'{name} rejected the trajectory')
            return
        execution.handles[name] = handle
        handle.get_result_async().add_done_callback(
            lambda result: self._ended(execution, name, result)
        )
        if execution.ending is not None:
            handle.cancel_goal_async()

    def _ended(self, execution: Execution, name: str, answer: Any) -> None:  # noqa: ANN401
        execution.waits_for.discard(name)
        wrapped = answer.result()
        if wrapped.status == GoalStatus.STATUS_SUCCEEDED and not _code(wrapped.result):
            self._conclude(execution)
            return
        self._fail(execution, f'{name}: {_words(wrapped)}')

    def _fail(self, execution: Execution, reason: str) -> None:
        execution.is_complete = False
        if execution.ending is None:
            self.stop(execution, PlanningCode.CONTROL_FAILED, reason)
            if self.on_failure is not None:
                execution.in_doubt = True
                self.on_failure(execution)
        self._conclude(execution)

    def _conclude(self, execution: Execution) -> None:
        """End an execution when all of its controllers have ended."""
        if execution.waits_for or execution.in_doubt or execution not in self._running:
            return
        if execution.is_complete and execution.ending and execution.ending[0] is INVALIDATED:
            execution.ending = None  # the end of the trajectory came before the stop
        self._running.remove(execution)
        self._report(execution)

    def _report(self, execution: Execution) -> None:
        if not execution.is_over:
            execution.is_over = True
            execution.done(*(execution.ending or (PlanningCode.SUCCESS, '')))

    def _note_state(self, name: str, message: bytes) -> None:
        self._states[name] = time.monotonic(), message

    def _speed(self, name: str) -> float:
        """Return the speed override of a controller: 0 while paused, 1 if unknown.

        Also record whether the reference of the controller moves. Many releases of
        joint_trajectory_controller leave the field at 0, so 0 means a pause only after a
        nonzero value.
        """
        at, message = self._states.get(name, (-math.inf, b''))
        if time.monotonic() - at > STATE_TIMEOUT:
            return 1.0
        state = deserialize_message(message, JointTrajectoryControllerState)
        reference = state.reference.positions.tobytes()
        if self._references.get(name) != reference:
            self._references[name] = reference
            self._moving.add(name)
        factor = float(state.speed_scaling_factor)
        if factor > 0.0:
            self._scaling.add(name)
        return min(factor, 1.0) if name in self._scaling and factor >= 0.0 else 1.0

    def _lost(self, execution: Execution) -> str:
        """Return the first active controller whose action disappeared; empty if none did."""
        if execution.ending is not None:
            return ''
        awaited = sorted(execution.waits_for)
        return next((name for name in awaited if not self._clients[name].server_is_ready()), '')

    def _is_overdue(self, execution: Execution, passed: float) -> bool:
        """Whether an execution takes too long, not counting delays by a speed override.

        Pauses of this process do not count either. A controller whose reference moves is not
        overdue: a busy computer only delays its cycles. Grippers have no time limit: they end
        their goal when they stall.
        """
        pause = max(passed - MAX_WATCH_PERIOD, 0.0)
        execution.deadline += pause
        if execution.ending is None:
            timed = self._timed & execution.waits_for
            if not timed:
                return False
            execution.deadline += (passed - pause) * (1.0 - min(map(self._speed, timed)))
            if timed & self._moving:
                margin = self._limits.duration_margin + STATE_TIMEOUT
                execution.deadline = max(execution.deadline, time.monotonic() + margin)
        return time.monotonic() > execution.deadline

    def _watch(self) -> None:
        before, self._watched = self._watched, time.monotonic()
        for name in self._clients:
            self._is_found(name)
        self._moving.clear()
        for name in self._timed - self._scaling:
            self._speed(name)
        for execution in list(self._running):
            try:
                self._watch_execution(execution, self._watched - before)
            except Exception as error:  # noqa: BLE001, PERF203  # it must not go on unwatched
                reason = f'it cannot be watched: {type(error).__name__}: {error}'
                self.stop(execution, PlanningCode.CONTROL_FAILED, reason)

    def _watch_execution(self, execution: Execution, passed: float) -> None:
        """Stop an execution that cannot continue or takes too long; ``passed`` is in [s]."""
        if execution.held:
            self._look_again(execution)
        elif lost := self._lost(execution):
            reason = f'{lost}: its action is gone while it moves; restart the controller'
            self.stop(execution, PlanningCode.CONTROL_FAILED, reason)
        elif not self._is_overdue(execution, passed):
            return
        elif execution.ending is None:
            allowed = execution.deadline - execution.begin
            self.stop(
                execution,
                PlanningCode.TIMED_OUT,
                'Controller is taking too long to execute trajectory (the expected upper'
                f' bound for the trajectory execution was {allowed:.2f} seconds)',
            )
        else:
            self._give_up(execution)

    def _give_up(self, execution: Execution) -> None:
        """Report that a controller may still move, and cancel its goal again.

        Its joints are released when it responds, no longer knows the goal, or is gone.
        """
        self.explain(execution, '')
        if not execution.is_over and execution.ending is not None:
            _, why = execution.ending
            reason = f'{why}; {_unconfirmed(execution)}, its joints are refused until it does'
            execution.ending = PlanningCode.CONTROL_FAILED, reason
            self._report(execution)
        execution.deadline = time.monotonic() + STOP_TIMEOUT
        for name in list(execution.waits_for):
            if not self._clients[name].server_is_ready():
                execution.waits_for.discard(name)
            elif name in execution.handles:
                execution.handles[name].cancel_goal_async().add_done_callback(
                    lambda answer, name=name: self._asked_again(execution, name, answer)
                )
        self._conclude(execution)

    def _asked_again(self, execution: Execution, name: str, answer: Any) -> None:  # noqa: ANN401
        if answer.result().return_code in FORGOTTEN:
            execution.waits_for.discard(name)
            self._conclude(execution)


def _code(result: Any) -> int:  # noqa: ANN401
    """Return the error code of a result; gripper results have none."""
    return int(getattr(result, 'error_code', 0))


def _words(ended: Any) -> str:  # noqa: ANN401
    """Return why a controller did not reach the end; some give no details."""
    code = _code(ended.result)
    if words := getattr(ended.result, 'error_string', ''):
        return str(words)
    if getattr(ended.result, 'stalled', False):
        return 'stalled before its goal'
    if code:
        return GoalCode(code).name if code in set(GoalCode) else f'error code {code}'
    if ended.status == GoalStatus.STATUS_CANCELED:
        return 'canceled by another client'
    return 'did not reach the end, and gave no reason'


def _unconfirmed(execution: Execution) -> str:
    return f'{", ".join(sorted(execution.waits_for))} did not confirm that it stopped'
