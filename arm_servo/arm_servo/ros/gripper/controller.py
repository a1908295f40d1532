# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The gripper controller's actions on a node."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
import time
import traceback
from typing import Any

import numpy as np
from rclpy.action.server import ActionServer, CancelResponse
from rclpy.node import Node

from arm_model import ArmError, RobotState
from arm_trajectory import GoalCode
from node_runner.action_goals import serve_goals

from ...controllers.controller import CONTINUED, Source
from ...core.gateway import CommandGateway
from ...core.motion_queue import MotionCommand
from ...core.requests import TargetRequest
from .interfaces import GripperInterface, GripperState, PARALLEL, SINGLE
from .parameters import GripperParameters

WATCH_RATE = 20.0  # rate of feedback in [Hz]
START_TIMEOUT = 5.0  # time in which the cycle must begin with a goal in [s]

NO_EFFORT_LIMIT = (
    'the effort of the goal limits nothing: drives get positions only; '
    'set 0x6072 (max torque) of the drive to limit it'
)


@dataclass(slots=True)
class _Goal:
    """A goal from its acceptance to its end."""

    handle: Any
    interface: GripperInterface
    command: MotionCommand | None = None  # None for a goal that is refused at once
    problem: str = ''
    begin: float = field(default_factory=time.monotonic)
    last_motion: float = field(default_factory=time.monotonic)
    state: GripperState | None = None
    is_concluded: bool = False


class GripperController:
    """``~/gripper_cmd`` and ``~/parallel_gripper_cmd``: positions of the joints of a gripper.

    A newer goal, of either action, takes over. The drives are commanded positions: efforts of
    goals are not limits here, which a warning says.
    """

    def __init__(
        self,
        node: Node,
        gateway: CommandGateway,
        parameters: GripperParameters,
        check_active: Callable[[], None],
        prepare: Callable[[], object],
    ) -> None:
        """Offer them; the first only for a gripper of one joint.

        Args:
            check_active: Raises an ArmError where no motion may begin.
        """
        self._node, self._gateway = node, gateway
        self._parameters = parameters
        self._check_active, self._prepare = check_active, prepare
        self._joints = gateway.model.joints
        self._goals: dict[bytes, _Goal] = {}
        self._newest: MotionCommand | None = None  # of those that have begun
        self._abandoned: MotionCommand | None = None  # drives still have its set-points
        self._has_warned = False
        interfaces = [PARALLEL, SINGLE] if len(self._joints) == 1 else [PARALLEL]
        self._servers: dict[str, ActionServer] = {
            interface.name: serve_goals(
                node,
                interface.action,
                interface.name,
                start=partial(self._start, interface),
                conclude=self._conclude,
                cancel=self._cancel,
            )
            for interface in interfaces
        }
        node.create_timer(1.0 / WATCH_RATE, self._watch)

    def _start(self, interface: GripperInterface, handle: Any) -> None:  # noqa: ANN401  # rclpy has no types here
        goal = self._goals[bytes(handle.goal_id.uuid)] = _Goal(handle, interface)
        try:
            request = interface.request(handle.request, self._joints)
            self._check_active()
            if interface.asks_effort(handle.request) and not self._has_warned:
                self._has_warned = True
                self._node.get_logger().warning(NO_EFFORT_LIMIT)
            goal.command = self._gateway.request(request, self._prepare)
        except ArmError as error:
            goal.problem = str(error)
        except Exception as error:  # noqa: BLE001  # a goal must not end the program
            goal.problem = f'{type(error).__name__}: {error}'
            self._node.get_logger().error(traceback.format_exc())

    def _cancel(self, handle: Any) -> CancelResponse:  # noqa: ANN401
        goal = self._goals.get(bytes(handle.goal_id.uuid))
        if goal is not None and goal.command is not None:
            self._gateway.cancel(goal.command, 'canceled')
        return CancelResponse.ACCEPT

    def _watch(self) -> None:
        measured = self._gateway.snapshot.measured
        for goal in list(self._goals.values()):
            if goal.is_concluded:
                continue
            self._note_begin(goal.command)
            if measured is not None:
                goal.state = self._look(goal, measured)
            goal.problem = goal.problem or self._problem(goal)
            state = goal.state
            if goal.problem or (state is not None and (state.reached or state.stalled)):
                goal.is_concluded = True
                if goal.command is not None and not self._succeeds(goal):
                    self._gateway.cancel(goal.command, 'stalled')  # nothing moves after the end
                    self._abandoned = goal.command
                server = self._servers[goal.interface.name]
                server.notify_execute(goal.handle, None)  # leads to _conclude
            elif state is not None:
                goal.handle.publish_feedback(goal.interface.feedback(state))
        self._hold()

    def _note_begin(self, command: MotionCommand | None) -> None:
        if command is None or command.motion is None:
            return
        if self._newest is None or command.number > self._newest.number:
            self._newest = command

    def _succeeds(self, goal: _Goal) -> bool:
        """Whether a goal that ends is reached, or ends with something held."""
        state = goal.state
        if goal.problem or state is None:
            return False
        return state.reached or (state.stalled and self._parameters.allow_stalling)

    def _hold(self) -> None:
        """Hold the drives where they are, once a goal that was not reached has come to rest.

        They may be blocked, and would push on towards the place of the last set-point.
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
        moves = (np.abs(measured.velocity) > self._parameters.stall_velocity).any()
        if point.source is not Source.NONE or point.state.moving or moves:
            return
        self._abandoned = None
        off = np.abs(point.state.position - measured.position)
        if (off > self._parameters.goal_tolerance).any():
            limits = self._gateway.model.limits
            there = np.clip(measured.position, limits.lower, limits.upper)
            self._gateway.request(
                TargetRequest(dict(zip(self._joints, there.tolist(), strict=True)))
            )

    def _look(self, goal: _Goal, measured: RobotState) -> GripperState:
        """Return where the gripper is, and whether it stalls or is there."""
        now, command = time.monotonic(), goal.command
        moves = bool((np.abs(measured.velocity) > self._parameters.stall_velocity).any())
        if moves or not self._is_pushed(command):
            goal.last_motion = now
        reached = False
        if command is not None and command.ended.done():
            reached = command.ended.result().code is GoalCode.SUCCESSFUL and self._there(
                command, measured
            )
        stalled = not reached and now - goal.last_motion > self._parameters.stall_timeout
        return GripperState(self._joints, measured, stalled, reached)

    def _is_pushed(self, command: MotionCommand | None) -> bool:
        """Whether set-points move the gripper, or have done so: not before it, or in a pause."""
        if command is None or command.motion is None:
            return False
        point = self._gateway.snapshot.set_point
        return command.ended.done() or (
            point is not None
            and bool((np.abs(point.state.velocity) > self._parameters.stall_velocity).any())
        )

    def _there(self, command: MotionCommand, measured: RobotState) -> bool:
        """Whether all joints of a goal are within its tolerance."""
        positions = dict(zip(self._joints, measured.position.tolist(), strict=True))
        targets = getattr(command.request, 'positions', {})
        tolerance = self._parameters.goal_tolerance
        return all(abs(positions[name] - target) <= tolerance for name, target in targets.items())

    def _problem(self, goal: _Goal) -> str:
        """Return why a goal cannot go on; empty while it can."""
        command = goal.command
        if command is None:
            return 'it was refused'
        if command.ended.done():
            outcome = command.ended.result()
            if outcome is CONTINUED:
                return 'a newer goal took over'
            if outcome.code is not GoalCode.SUCCESSFUL or outcome.canceled:
                return outcome.reason
            return 'canceled' if goal.handle.is_cancel_requested else ''
        if command.motion is None and time.monotonic() - goal.begin > START_TIMEOUT:
            self._gateway.cancel(command, 'the cycle does not run')
            return 'the cycle does not run; is the bus up?'
        return ''

    def _conclude(self, handle: Any) -> Any:  # noqa: ANN401
        goal = self._goals.pop(bytes(handle.goal_id.uuid))
        nothing = RobotState.at_rest(np.full(len(self._joints), np.nan))
        state = goal.state or GripperState(self._joints, nothing)
        if goal.problem and handle.is_cancel_requested:
            handle.canceled()
        elif self._succeeds(goal):
            handle.succeed()
        else:
            reason = goal.problem or 'stalled in front of the goal (allow_stalling is false)'
            self._node.get_logger().warning(f'goal aborted: {reason}')
            handle.abort()
        return goal.interface.result(state)
