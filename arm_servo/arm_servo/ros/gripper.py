# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The gripper controller on a node: its parameters, under gripper_controllers' names, and actions.

Both actions, for one joint and for several, become single targets of the joints.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
import math
import time
from typing import Any

from control_msgs.action import GripperCommand, ParallelGripperCommand
import numpy as np
from rclpy.node import Node
from sensor_msgs.msg import JointState

from arm_model import Array, CommandError, RobotState
from arm_trajectory import GoalCode
from node_runner.action_goals import Ending
from robot_primitives import setting, switch

from ..controllers.controller import CONTINUED, Outcome, refused, Source
from ..core.gateway import CommandGateway, MotionCommand
from ..core.requests import TargetRequest
from .motion_goals import MotionGoal, MotionGoals


@dataclass(frozen=True, slots=True)
class GripperState:
    """Measured state of a gripper."""

    joints: Sequence[str]  # names of its joints
    measured: RobotState  # what was measured of them
    stalled: bool = False  # it does not move although it is not at the goal
    reached: bool = False  # it is at the goal


@dataclass(frozen=True, slots=True)
class GripperInterface:
    """Interface of one gripper action; its goals and messages are untyped."""

    action: Any
    name: str
    request: Callable[[Any, Sequence[str]], TargetRequest]  # what a goal asks of the joints
    asks_effort: Callable[[Any], bool]  # whether a goal asks for a limit of effort


def _parallel_request(goal: Any, joints: Sequence[str]) -> TargetRequest:  # noqa: ANN401
    """Convert a goal to a target request; a single joint need not be named."""
    command = goal.command
    names = list(command.name) or list(joints[:1])
    if len(names) != len(command.position):
        raise CommandError(f'{len(names)} names, but {len(command.position)} positions')
    if lost := [name for name in names if name not in joints]:
        raise CommandError(f'no joint {lost[0]!r} in the gripper; joints: {", ".join(joints)}')
    if twice := [name for name in names if names.count(name) > 1]:
        raise CommandError(f'joint {twice[0]!r} is named twice')
    if wrong := [speed for speed in command.velocity if not speed >= 0.0]:
        raise CommandError(f'velocity {wrong[0]}: it must be above 0, or 0 for the limit')
    speeds = [speed for speed in command.velocity if speed > 0.0]
    targets = _finite(dict(zip(names, command.position, strict=True)))
    return TargetRequest(targets, min(speeds, default=math.inf))


def _finite(positions: Mapping[str, float]) -> Mapping[str, float]:
    for name, position in positions.items():
        if not math.isfinite(position):
            raise CommandError(f'{name}: {position} is no position')
    return positions


def _message(kind: Any, state: GripperState) -> Any:  # noqa: ANN401
    """Convert a state to a message that may lack some of the fields."""
    measured = state.measured
    fields = {
        'position': float(measured.position[0]),
        'state': JointState(
            name=list(state.joints),
            position=measured.position.tolist(),
            velocity=measured.velocity.tolist(),
        ),
        'stalled': state.stalled,
        'reached_goal': state.reached,
    }
    known = kind.get_fields_and_field_types()
    return kind(**{name: value for name, value in fields.items() if name in known})


SINGLE = GripperInterface(
    GripperCommand,
    '~/gripper_cmd',
    lambda goal, joints: TargetRequest(_finite({joints[0]: goal.command.position})),
    lambda goal: bool(goal.command.max_effort),
)
"""The GripperCommand action, for a gripper of one joint."""

PARALLEL = GripperInterface(
    ParallelGripperCommand,
    '~/parallel_gripper_cmd',
    _parallel_request,
    lambda goal: any(goal.command.effort),
)
"""The ParallelGripperCommand action: joint positions and speed limits."""


@dataclass(frozen=True, slots=True)
class GripperParameters:
    """Parameters of the gripper controller."""

    goal_tolerance: float = setting(0.002, 0.0, 10.0, 'how far a joint may be off [rad] or [m]')
    stall_velocity_threshold: float = setting(
        0.001, 0.0, 10.0, 'speed below which a joint does not move [rad/s] or [m/s]'
    )
    stall_timeout: float = setting(1.0, 0.05, 60.0, 'time without motion that is a stall [s]')
    allow_stalling: bool = switch(False, 'a goal that ends stalled succeeds')


WATCH_RATE = 20.0  # rate of feedback in [Hz]

NO_EFFORT_LIMIT = (
    'the effort of the goal limits nothing: drives get positions only; '
    'set 0x6072 (max torque) of the drive to limit it'
)


@dataclass(slots=True, eq=False)
class _Goal(MotionGoal):
    """A goal from its request to its end."""

    problem: str = ''  # why it cannot go on, and waits for rest; empty while it can
    last_motion: float = field(default_factory=time.monotonic)
    last_place: Array | None = None  # where the joints were then in [rad]
    state: GripperState | None = None


class GripperController:
    """``~/gripper_cmd`` and ``~/parallel_gripper_cmd``: positions of the joints of a gripper.

    A newer goal of either action takes over. The drives get position commands: efforts in
    goals are not applied as limits, and a warning says so.
    """

    def __init__(
        self,
        node: Node,
        gateway: CommandGateway,
        parameters: GripperParameters,
        check_active: Callable[[], None],  # raises an ArmError where no motion may begin
    ) -> None:
        """Offer the actions; ``~/gripper_cmd`` only for a gripper of one joint."""
        self._node, self._gateway = node, gateway
        self._parameters = parameters
        self._check_active = check_active
        self._joints = gateway.model.joints
        self._newest: MotionCommand | None = None  # of those that have begun
        self._abandoned: MotionCommand | None = None  # drives still have its set-points
        self._has_warned = False
        interfaces = [PARALLEL, SINGLE] if len(self._joints) == 1 else [PARALLEL]
        self._servers: list[tuple[GripperInterface, MotionGoals[_Goal]]] = [
            (
                interface,
                MotionGoals(
                    node,
                    gateway,
                    interface.action,
                    interface.name,
                    accept=_Goal,
                    request=partial(self._request, interface),
                    canceled='canceled',
                    conclude=partial(self._conclude, interface),
                    fail=partial(self._fail, interface),
                    rest_speed=parameters.stall_velocity_threshold,
                ),
            )
            for interface in interfaces
        ]
        node.create_timer(1.0 / WATCH_RATE, self._watch)

    def _request(self, interface: GripperInterface, goal: _Goal) -> MotionCommand:
        request = interface.request(goal.handle.request, self._joints)
        self._check_active()
        if interface.asks_effort(goal.handle.request) and not self._has_warned:
            self._has_warned = True
            self._node.get_logger().warning(NO_EFFORT_LIMIT)
        return self._gateway.request(request, goal.number)

    def _watch(self) -> None:
        is_preparing = self._gateway.is_preparing  # first: what begins meanwhile is seen below
        for interface, goals in self._servers:
            goals.watch(partial(self._watch_goal, interface, goals))
        if not is_preparing:  # a newer goal takes the gripper from where it is
            self._hold()

    def _watch_goal(
        self, interface: GripperInterface, goals: MotionGoals[_Goal], goal: _Goal
    ) -> None:
        measured, command = self._gateway.snapshot.measured, goal.command
        newest = -1 if self._newest is None else self._newest.number
        if command is not None and command.motion is not None and command.number > newest:
            self._newest = command
        if measured is not None:
            goal.state = self._look(goal, measured)
        was_ending = bool(goal.problem)
        goal.problem = goal.problem or self._problem(goal, goals.outcome(goal))
        if goal.problem:
            if goal.command is not None and not was_ending:
                self._gateway.cancel(goal.command, 'stalled')  # nothing moves after it
                self._abandoned = goal.command
            if goals.has_stopped(goal):
                goals.end(goal)
        elif goal.state is not None and self._succeeds(goal.state):
            goals.end(goal)
        elif goal.state is not None:
            goal.handle.publish_feedback(_message(interface.action.Feedback, goal.state))

    def _succeeds(self, state: GripperState) -> bool:
        """Return whether a goal is reached, or the gripper stalls on an object and may."""
        return state.reached or (state.stalled and self._parameters.allow_stalling)

    def _hold(self) -> None:
        """Hold the measured position once the gripper rests after a goal that it did not reach.

        Blocked drives would otherwise keep pushing towards the last set-point.
        """
        snapshot, command = self._gateway.snapshot, self._abandoned
        point, measured = snapshot.set_point, snapshot.measured
        if command is None or not command.ended.done() or snapshot.paused:
            return
        if point is None or measured is None:  # they are commanded no more
            self._abandoned = None
            return
        if command is not self._newest or point.source is Source.TRAJECTORY:  # another does
            self._abandoned = None
            return
        moves = (np.abs(measured.velocity) > self._parameters.stall_velocity_threshold).any()
        if point.source is not Source.NONE or point.state.moving or moves:
            return
        self._abandoned = None
        off = np.abs(point.state.position - measured.position)
        if (off > self._parameters.goal_tolerance).any():
            limits = self._gateway.model.limits
            there = np.clip(measured.position, limits.lower, limits.upper)
            self._gateway.request(
                TargetRequest(dict(zip(self._joints, there.tolist(), strict=True))),
                takes_drives=False,
            )

    def _look(self, goal: _Goal, measured: RobotState) -> GripperState:
        """Return the measured state, and whether the gripper stalls or has reached the goal."""
        now, command, parameters = time.monotonic(), goal.command, self._parameters
        moves = bool((np.abs(measured.velocity) > parameters.stall_velocity_threshold).any())
        if goal.last_place is not None:  # joint states may have no velocities
            way = parameters.stall_velocity_threshold * parameters.stall_timeout
            moves |= bool((np.abs(measured.position - goal.last_place) > way).any())
        if moves or goal.last_place is None or not self._is_pushed(command):
            goal.last_motion, goal.last_place = now, measured.position
        reached = False
        if command is not None and command.ended.done():
            reached = command.ended.result().code is GoalCode.SUCCESSFUL and self._there(
                command, measured
            )
        stalled = not reached and now - goal.last_motion > parameters.stall_timeout
        return GripperState(self._joints, measured, stalled, reached)

    def _is_pushed(self, command: MotionCommand | None) -> bool:
        """Return whether set-points move the gripper, or the motion has ended; not in a pause."""
        if command is None or command.motion is None:
            return False
        point = self._gateway.snapshot.set_point
        return command.ended.done() or (
            point is not None
            and bool(
                (np.abs(point.state.velocity) > self._parameters.stall_velocity_threshold).any()
            )
        )

    def _there(self, command: MotionCommand, measured: RobotState) -> bool:
        """Return whether all joints are within tolerance of the goal."""
        positions = dict(zip(self._joints, measured.position.tolist(), strict=True))
        targets = getattr(command.request, 'positions', {})
        tolerance = self._parameters.goal_tolerance
        return all(abs(positions[name] - target) <= tolerance for name, target in targets.items())

    def _problem(self, goal: _Goal, outcome: Outcome | None) -> str:
        """Return why a goal has failed; empty while it can continue."""
        if outcome is CONTINUED:
            return 'a newer goal took over'
        if outcome and (outcome.code is not GoalCode.SUCCESSFUL or outcome.canceled):
            return outcome.reason
        if outcome and goal.handle.is_cancel_requested:
            return 'canceled'
        state = goal.state
        if state is None or not state.stalled or self._parameters.allow_stalling:
            return ''
        return 'stalled in front of the goal (allow_stalling is false)'

    def _conclude(self, interface: GripperInterface, goal: _Goal) -> tuple[Ending, Any]:
        result = _message(interface.action.Result, self._state_of(goal))
        if not goal.problem:
            return Ending.SUCCEEDED, result
        ending = Ending.CANCELED if goal.handle.is_cancel_requested else Ending.ABORTED
        if goal.unrest or ending is Ending.ABORTED:
            text = f'goal {ending.value}: {goal.problem}{goal.unrest}'
            self._node.get_logger().warning(text)
        return ending, result

    def _fail(self, interface: GripperInterface, goal: _Goal, error: Exception) -> Any:  # noqa: ANN401
        self._node.get_logger().warning(f'goal aborted: {refused(error).reason}{goal.unrest}')
        return _message(interface.action.Result, replace(self._state_of(goal), reached=False))

    def _state_of(self, goal: _Goal) -> GripperState:
        measured = self._gateway.snapshot.measured
        measured = measured or RobotState.at_rest(np.full(len(self._joints), np.nan))
        return goal.state or GripperState(self._joints, measured)
