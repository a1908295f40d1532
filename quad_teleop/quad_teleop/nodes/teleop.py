# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run quad_teleop teleop_keyboard`` and ``teleop_gamepad``: drive by keys or gamepad.

Common parts come first: parameters, topics, requests to the controller and its reports. Values of
wrong type or out of range raise ParameterError, contradictory ones SettingError.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
import math
import time
from typing import Any

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, TwistStamped, Vector3
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.task import Future
from std_srvs.srv import Trigger

from node_runner import destroyed_when_refused, ParameterReader, refuse_misspelt
from operator_input import CommandStream
from operator_input.devices import InputDevices
from operator_input.ros import declare_gamepad, declare_keyboard, run_teleop, TeleopNode
from quad_msgs.srv import SetMode

from ..exceptions import SettingError, TeleopError
from ..mappings import GamepadTeleop, KeyboardTeleop
from ..motion import (
    BodyPose,
    ControllerReport,
    MIN_SPEED,
    Mode,
    PoseSteps,
    read_report,
    rest_of,
    RobotRequest,
    Speeds,
    Velocity,
)

FLUSH_TIMEOUT = Duration(nanoseconds=300_000_000)
ANSWER_TIMEOUT = 3.0  # [s]
DISCOVERY_TIMEOUT = 2.0  # [s] that DDS may need to find a service after the start
KEY_REPEAT_TIME = 0.7  # [s] within which the same question is the keyboard repeating a key
SPEEDS = (MIN_SPEED, 3.0)  # [m/s] of any legged robot that people drive by hand
TURNS = (MIN_SPEED, 10.0)  # [rad/s]


def declare_speeds(node: Node, defaults: Mapping[str, Speeds]) -> list[Speeds]:
    """Declare ``speed`` and ``turn`` for each name prefix, and the limits of all."""
    read, limits = ParameterReader(node), Speeds()
    speed_limit = read.number('speed_limit', limits.linear_limit, SPEEDS, 'Highest speed [m/s]')
    turn_limit = read.number('turn_limit', limits.angular_limit, TURNS, 'Highest turn [rad/s]')
    return [
        Speeds(
            read.number(f'{prefix}speed', default.linear, SPEEDS, 'Speed of walking [m/s]'),
            read.number(f'{prefix}turn', default.angular, TURNS, 'of turning [rad/s]'),
            speed_limit,
            turn_limit,
        )
        for prefix, default in defaults.items()
    ]


def declare_stream(node: Node) -> CommandStream[Velocity]:
    """Declare the publishing rate."""
    read = ParameterReader(node)
    rate = read.number('repeat_rate', 20.0, (4.0, 200.0), 'Messages while active [Hz]')
    return CommandStream(1.0 / rate, rest_of)


@dataclass(frozen=True, slots=True)
class _Question:
    what: str  # in words
    request: Any
    requested_at: float


class CommandClient:
    """Client of a service that returns ``success`` and ``message``. Times are in [s]."""

    def __init__(
        self,
        node: Node,
        service_type: Any,  # noqa: ANN401
        service: str,
        show: Callable[[str], None],
        granted: Callable[[str], None] = lambda _: None,
        *,
        drops_repeats: bool = True,
    ) -> None:
        """Create the client.

        Args:
            node: The node; spin it to receive answers.
            service_type: Type of the service.
            service: Name of the service.
            show: Called with each answer, or the reason for its absence.
            granted: Called with the request when it was granted.
            drops_repeats: Do not resend the same request while a key repeats it.
        """
        self._client = node.create_client(service_type, service)
        self._name = node.resolve_service_name(service)
        self._show = show
        self._granted = granted
        self._drops_repeats = drops_repeats
        self._question: _Question | None = None  # the last one
        self._future: Future | None = None
        self._is_waiting = False  # for the service to be found

    def request(self, what: str, request: Any, now: float) -> None:  # noqa: ANN401
        """Send a named request; this drops a pending one."""
        last = self._question
        if (
            self._drops_repeats
            and last is not None
            and last.what == what
            and now - last.requested_at < KEY_REPEAT_TIME
        ):
            return
        self.cancel()
        self._question = _Question(what, request, now)
        self._is_waiting = True
        self.check(now)

    def cancel(self) -> None:
        """Drop a pending request: do not send it, or ignore its answer."""
        self._question = None
        self._is_waiting = False
        self._forget()

    def check(self, now: float) -> None:
        """Send requests that wait for the service; drop overdue ones."""
        question = self._question
        if question is None:
            return
        age = now - question.requested_at
        if self._is_waiting and self._client.service_is_ready():
            self._is_waiting = False
            self._future = self._client.call_async(question.request)
            self._future.add_done_callback(partial(self._answered, question.what))
        elif self._is_waiting and age > DISCOVERY_TIMEOUT:
            self._is_waiting = False
            self._show(
                f'{question.what}: no service {self._name}; is controller_node '
                'running, with this ROS_DOMAIN_ID and namespace?'
            )
        elif self._future is not None and age > ANSWER_TIMEOUT:
            self._forget()
            self._show(
                f'{question.what}: no answer of {self._name} within {ANSWER_TIMEOUT:.0f} s; '
                'does controller_node still run?'
            )

    def _forget(self) -> None:
        if self._future is not None:
            self._client.remove_pending_request(self._future)
            self._future = None

    def _answered(self, what: str, future: Future) -> None:
        if future is not self._future:
            return
        self._future = None
        response = future.result()
        if response is None:
            return
        if response.success:
            self._granted(what)
            self._show(f'{what}: {response.message or "done"}')
        else:
            self._show(f'{what} refused: {response.message}')


class RobotLink:
    """Publishes velocities as Twist, TwistStamped or both, and poses of the body.

    Client of ``set_mode``, ``stop`` and ``controller_node/clear_fault``; reads /diagnostics.
    """

    def __init__(self, node: Node, say: Callable[[str], None]) -> None:
        """Declare the topic parameters, and connect.

        Raises:
            ParameterError: A value has the wrong type.
            SettingError: Both message types are disabled.
        """
        read = ParameterReader(node)
        twist = read.flag('twist', 'publish cmd_vel (Twist)', default=True)
        stamped = read.flag('stamped', 'publish cmd_vel_stamped (TwistStamped)', default=False)
        if not (twist or stamped):
            raise SettingError('twist and stamped are both false: nothing would be published')
        self.say = say  # shows the person answers, and why there is none
        self.mode: Mode | None = None  # the mode that was granted last; None before
        self._node = node
        self._frame = read.text('frame_id', 'base_link', 'frame of TwistStamped')
        self._pose = node.create_publisher(Pose, 'body_pose', 1)
        self._twist = node.create_publisher(Twist, 'cmd_vel', 1) if twist else None
        self._stamped = (
            node.create_publisher(TwistStamped, 'cmd_vel_stamped', 1) if stamped else None
        )
        self._publishers = [each for each in (self._twist, self._stamped) if each is not None]
        self._report: ControllerReport | None = None
        self._said, self._said_at = '', -math.inf
        self._modes = CommandClient(node, SetMode, 'set_mode', self._say_once, self._granted)
        self._faults = CommandClient(node, Trigger, 'controller_node/clear_fault', self._say_once)
        self._stops = CommandClient(
            node, Trigger, 'stop', self._say_once, self._stopped, drops_repeats=False
        )
        node.create_subscription(DiagnosticArray, 'diagnostics', self._take, 10)

    @property
    def has_subscriber(self) -> bool:
        """Whether the velocity topics have subscribers."""
        return any(publisher.get_subscription_count() for publisher in self._publishers)

    def report(self, now: float) -> ControllerReport | None:
        """Return the last controller report; None if it is outdated."""
        report = self._report
        return report if report is not None and report.is_fresh(now) else None

    def publish(self, command: Velocity) -> None:
        """Publish a velocity."""
        twist = Twist(
            linear=Vector3(x=command.x, y=command.y, z=0.0),
            angular=Vector3(x=0.0, y=0.0, z=command.yaw),
        )
        if self._twist is not None:
            self._twist.publish(twist)
        if self._stamped is not None:
            message = TwistStamped(twist=twist)
            message.header.frame_id = self._frame
            message.header.stamp = self._node.get_clock().now().to_msg()
            self._stamped.publish(message)

    def handle(self, request: Mode | BodyPose | RobotRequest, now: float) -> None:
        """Request a mode, publish a pose of the body, clear the faults, or stop.

        Every stop is sent; it cancels an earlier mode request.
        """
        match request:
            case Mode():
                self._modes.request(request.value, SetMode.Request(mode=request.value), now)
            case BodyPose():
                x, y, z, w = request.quaternion()
                position = Point(x=0.0, y=0.0, z=request.height)
                orientation = Quaternion(x=x, y=y, z=z, w=w)
                self._pose.publish(Pose(position=position, orientation=orientation))
            case RobotRequest.CLEAR_FAULT:
                self._faults.request('clear fault', Trigger.Request(), now)
            case RobotRequest.STOP:
                self._modes.cancel()
                self._stops.request('stop', Trigger.Request(), now)

    def serve(self, now: float) -> None:
        """Send due requests and drop overdue ones."""
        for client in (self._modes, self._faults, self._stops):
            client.check(now)

    def flush(self) -> None:
        """Wait a limited time until the last velocities have arrived."""
        for publisher in self._publishers:
            publisher.wait_for_all_acked(FLUSH_TIMEOUT)

    def _say_once(self, text: str) -> None:
        """Show an answer, but only once while a held key repeats."""
        now = time.monotonic()
        if text != self._said or now - self._said_at >= KEY_REPEAT_TIME:
            self.say(text)
        self._said, self._said_at = text, now

    def _stopped(self, _: str) -> None:
        self.mode = None  # the controller knows

    def _granted(self, mode: str) -> None:
        self.mode = Mode(mode)

    def _take(self, message: DiagnosticArray) -> None:
        for status in message.status:
            values = {entry.key: entry.value for entry in status.values}
            level = int.from_bytes(status.level, 'little')
            report = read_report(status.name, level, status.message, values, time.monotonic())
            self._report = report or self._report


class TeleopKeyboard(TeleopNode):
    """Publishes velocities and body poses, and requests modes."""

    @destroyed_when_refused
    def __init__(self) -> None:
        """Declare the parameters and advertise the topics.

        Raises:
            ParameterError: A parameter is misspelt, of the wrong type or out of range.
            SettingError: Parameters contradict each other.
        """
        super().__init__('teleop_keyboard')
        self.source, held = declare_keyboard(self)
        robot = RobotLink(self, self.get_logger().info)
        (speeds,) = declare_speeds(self, {'': Speeds()})
        steps = ParameterReader(self).settings(PoseSteps)
        self.mapping = KeyboardTeleop(robot, held, declare_stream(self), speeds, steps)
        refuse_misspelt(self)


GAMEPAD_SPEEDS = {'': Speeds(0.15, 0.6), 'turbo_': Speeds(0.3, 1.2)}


class TeleopGamepad(TeleopNode):
    """Publishes velocities and body poses, and requests modes."""

    @destroyed_when_refused
    def __init__(self, devices: InputDevices | None = None) -> None:
        """Declare the parameters and advertise the topics; use this machine's devices.

        Raises:
            ParameterError: A parameter is misspelt, of the wrong type or out of range.
            SettingError: Parameters contradict each other.
            PresetError: The preset is unknown.
        """
        super().__init__('teleop_gamepad')
        self.source, deadman = declare_gamepad(self, devices)
        self.robot = RobotLink(self, self.get_logger().info)  # what it publishes to
        normal, turbo = declare_speeds(self, GAMEPAD_SPEEDS)
        self.mapping = GamepadTeleop(
            self.robot,
            deadman,
            declare_stream(self),
            normal,
            turbo,
            steps=ParameterReader(self).settings(PoseSteps),
            warn=self.get_logger().warning,
        )
        refuse_misspelt(self)


def teleop_keyboard() -> int:
    """``ros2 run quad_teleop teleop_keyboard``: run until Ctrl-C; return the exit code."""
    return run_teleop('teleop_keyboard', TeleopKeyboard, TeleopError, patient=True)


def teleop_gamepad() -> int:
    """``ros2 run quad_teleop teleop_gamepad``: run until Ctrl-C; return the exit code."""
    return run_teleop('teleop_gamepad', TeleopGamepad, TeleopError, patient=False)
