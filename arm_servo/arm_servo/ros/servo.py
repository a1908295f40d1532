# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Servo node with the topics and services of moveit_servo, on the motion core.

Its status has moveit_servo's code, and a message that says what limits the motion.
"""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Future
from contextlib import suppress
from dataclasses import replace
from functools import partial
import time
import traceback
from typing import Any

from control_msgs.msg import JointJog
from geometry_msgs.msg import PoseStamped, TwistStamped
from moveit_msgs.msg import ServoStatus
from moveit_msgs.srv import ServoCommandType
from rcl_interfaces.msg import SetParametersResult
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_srvs.srv import Empty, SetBool, Trigger

from arm_model import ArmError, CommandError, ModelError
from arm_model.ros import seconds, TfListener
from arm_trajectory import GoalCode

from ..controllers.controller import Cause, JOGGING, MotionReport, NotReadyError, Outcome, Source
from ..core.gateway import CommandGateway
from ..core.requests import CommandType, DisplacementRequest, JogRequest, Snapshot, StopRequest
from .motion_goals import Refusals
from .servo_commands import CommandConverter, PREFIX, read_scales, ServoParameters, Units

HALTED_SPEED_FACTOR = 0.02  # share of the commanded speed below which a motion counts as halted


CODES = {
    Cause.COLLISION: (ServoStatus.DECELERATE_FOR_COLLISION, ServoStatus.HALT_FOR_COLLISION),
    Cause.SINGULARITY: (
        ServoStatus.DECELERATE_FOR_APPROACHING_SINGULARITY,
        ServoStatus.HALT_FOR_SINGULARITY,
    ),
    Cause.JOINT_POSITION: (ServoStatus.JOINT_BOUND, ServoStatus.JOINT_BOUND),
}
"""Status codes (slowed, halted) of each cause; speed and acceleration limits have none."""


def code_of(report: MotionReport) -> int:
    """Return the status code of the strongest limiter."""
    for limiter in report.limiters:
        if limiter.cause in CODES:
            return int(CODES[limiter.cause][limiter.factor < HALTED_SPEED_FACTOR])
    return int(ServoStatus.NO_WARNING)


def status_of(
    snapshot: Snapshot, refusal: str, paused: str, capped: str, age: float = 0.0
) -> tuple[int, str]:
    """Return status code and message.

    Args:
        refusal: Why the last command was refused, with the remedy; empty if it was accepted.
    """
    if refusal := refusal or snapshot.stale(age):
        return ServoStatus.INVALID, refusal
    if snapshot.set_point is None or snapshot.blocked:
        return ServoStatus.INVALID, snapshot.blocked
    if paused:
        return ServoStatus.NO_WARNING, paused
    if snapshot.paused:
        return ServoStatus.NO_WARNING, 'the arm is held; ~/resume of the trajectory controller'
    report = snapshot.set_point.report
    if snapshot.source is not Source.JOG:
        words = IDLE_WORDS[snapshot.source]
        return code_of(report), f'{words}; {report}' if report.limiters else words
    words = str(report) if not capped else f'{capped}; {report}'
    return code_of(report), words


IDLE_WORDS = {
    Source.TRAJECTORY: 'a trajectory moves the arm; a command takes over',
    Source.TARGET: 'moves to a target',
    Source.NONE: 'ready',
}


Convert = Callable[[Any, float], JogRequest | DisplacementRequest]

MAX_STAMP_AHEAD = 0.1  # how far ahead of this clock a stamp may be in [s]


class Servo:
    """``~/delta_twist_cmds``, ``~/delta_joint_cmds``, ``~/pose_target_cmds``, and services.

    Until a client selects a command type, commands of every type are accepted.
    """

    def __init__(
        self,
        node: Node,
        gateway: CommandGateway,
        parameters: ServoParameters,
    ) -> None:
        self._node, self._gateway, self._parameters = node, gateway, parameters
        self._paused = ''  # why the servo takes no commands; empty when it does
        self._kind: CommandType | None = None  # the chosen type of commands
        model = gateway.model
        frames = TfListener(
            node,
            model.kinematics,
            parameters.frame_prefix,
            model.base,
            world_frames=model.world_frames,
        )
        self.converter = CommandConverter(model, frames, parameters, read_scales(node))
        self._refusals = Refusals()
        self._status = node.create_publisher(ServoStatus, parameters.status_topic, 10)
        for kind, message, topic, convert in (
            (
                CommandType.TWIST,
                TwistStamped,
                parameters.cartesian_command_in_topic,
                self.converter.twist,
            ),
            (
                CommandType.JOINT_JOG,
                JointJog,
                parameters.joint_command_in_topic,
                self.converter.jog,
            ),
            (CommandType.POSE, PoseStamped, parameters.pose_command_in_topic, self.converter.pose),
        ):
            node.create_subscription(message, topic, partial(self._take, kind, convert), 10)
        node.create_service(ServoCommandType, '~/switch_command_type', self._switch)
        node.create_service(SetBool, '~/pause_servo', self._pause)
        for name, act in (
            ('~/start_servo', self._resume),
            ('~/unpause_servo', self._resume),
            ('~/stop_servo', self._hold),
        ):
            node.create_service(Trigger, name, partial(self._answer, act))
        node.create_service(Empty, '~/reset_servo_status', self._reset)
        node.add_on_set_parameters_callback(self._check_scales)
        node.add_post_set_parameters_callback(self._rescale)
        node.create_timer(1.0 / parameters.status_rate, self._publish_status)

    def _switch(
        self, request: ServoCommandType.Request, response: ServoCommandType.Response
    ) -> ServoCommandType.Response:
        with suppress(ValueError):
            self._kind = CommandType(request.command_type)
            self._gateway.renew(Source.JOG)
            response.success = True
        return response

    def _pause(self, request: SetBool.Request, response: SetBool.Response) -> SetBool.Response:
        return self._answer(self._hold if request.data else self._resume, request, response)

    def _answer(self, act: Callable[[], str], _: object, response: Any) -> Any:  # noqa: ANN401
        response.success, response.message = True, act()
        return response

    def _reset(self, _: Empty.Request, response: Empty.Response) -> Empty.Response:
        self._kind = None
        return response

    def _hold(self) -> str:
        self._paused = 'the servo is paused; call ~/pause_servo with data: false'
        self._gateway.command(StopRequest('the servo was paused', JOGGING))
        return 'paused; jogging comes to rest, trajectories go on'

    def _resume(self) -> str:
        self._paused = ''
        self._gateway.renew(Source.JOG)
        return 'takes commands'

    def _take(self, kind: CommandType, convert: Convert, message: Any) -> None:  # noqa: ANN401  # messages have no type
        begin = time.monotonic()
        try:
            age = self._admitted(kind, message)
            request = convert(message, begin - age)
            self._send(request, (kind, message.header.frame_id))
        except ArmError as error:
            self._refuse(str(error))
        except Exception as error:  # noqa: BLE001  # a message must not end the program
            self._refuse(f'{type(error).__name__}: {error}')
            self._node.get_logger().error(
                f'a {kind.name} command raised {traceback.format_exc()}', throttle_duration_sec=5.0
            )

    def _send(
        self, request: JogRequest | DisplacementRequest, client: tuple[CommandType, str]
    ) -> None:
        """Send a request to the motion core."""
        # the events executor provides no publisher, so topic and frame identify the client
        note = partial(self._note, time.monotonic())
        if isinstance(request, JogRequest):
            request = replace(request, client=client)
            self._gateway.command(request).add_done_callback(note)
            return
        # a stream of displacements is held like a jog
        self._gateway.stream(Source.JOG, client, is_zero=request.is_zero)
        command = self._gateway.request(request, stream=client)
        command.future.add_done_callback(note)
        command.ended.add_done_callback(self._note_end)

    def _admitted(self, kind: CommandType, message: Any) -> float:  # noqa: ANN401
        """Check that a message is acceptable now; return its age in [s]."""
        if self._paused:
            raise CommandError(self._paused)
        if self._kind is not None and self._kind is not kind:
            raise CommandError(
                f'a {kind.name} command, but {self._kind.name} was chosen; call'
                f' ~/switch_command_type with command_type {int(kind)}'
            )
        stamp = seconds(message.header.stamp)
        if not stamp:  # as good as now
            return 0.0
        age = float(self._node.get_clock().now().nanoseconds) * 1e-9 - stamp
        timeout = self._parameters.incoming_command_timeout
        if age > timeout:
            raise NotReadyError(
                f'stale: {age:.2f} s old when it was read, and a command counts for {timeout:g} s'
                ' (incoming_command_timeout): sender or this computer is too busy, or clocks of'
                ' two computers differ; a stamp of 0 counts as now'
            )
        if age < -MAX_STAMP_AHEAD:
            raise NotReadyError(f'stamped {-age:.2f} s in the future: are the clocks in step?')
        return max(age, 0.0)

    def _note(self, sent: float, future: Future[Any]) -> None:
        """Record whether a command was accepted; runs in the cycle, so it must not log."""
        error = None if future.cancelled() else future.exception()
        if error is not None:
            self._refuse(str(error))
        else:
            self._refusals.clear(sent)

    def _note_end(self, future: Future[Outcome]) -> None:
        """Record why a displacement did not reach its end."""
        if future.result().code is GoalCode.PATH_TOLERANCE_VIOLATED:
            self._refuse(future.result().reason)

    def _refuse(self, reason: str) -> None:
        self._refusals.note(reason, time.monotonic())

    def _check_scales(self, parameters: list[Parameter]) -> SetParametersResult:
        for parameter in parameters:
            known = sorted(unit.value for unit in Units)
            if parameter.name == f'{PREFIX}command_in_type' and parameter.value not in known:
                reason = f'{parameter.name}: one of {known}'
                return SetParametersResult(successful=False, reason=reason)
        return SetParametersResult(successful=True)

    def _rescale(self, _parameters: list[Parameter]) -> None:
        with suppress(ModelError):
            self.converter.scales = read_scales(self._node)

    def _publish_status(self) -> None:
        now, snapshot = time.monotonic(), self._gateway.snapshot
        code, words = status_of(
            snapshot,
            self._refusals.fresh(now),
            self._paused,
            self.converter.capped,
            now - snapshot.time,
        )
        if reason := self._refusals.to_log(now):
            self._node.get_logger().warning(f'refused: {reason}')
        self._status.publish(ServoStatus(code=code, message=words))
