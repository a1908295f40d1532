# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Client of the servo node for teleop programs: sends motions and requests, reads its status."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
import math
import time
from typing import Any

from control_msgs.msg import JointJog as JointJogMessage
from geometry_msgs.msg import TwistStamped, Vector3
from moveit_msgs.msg import ServoStatus
from moveit_msgs.srv import ServoCommandType
from rcl_interfaces.msg import ParameterType
from rcl_interfaces.srv import GetParameters
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.parameter import parameter_value_to_python
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

from arm_model import ArmNames, ModelError, names_of
from node_runner import LATCHED, ParameterReader
from operator_input import CommandStream

from ..core.requests import CommandType
from .jog import (
    Frame,
    Jog,
    JointJog,
    rest_of,
    Scales,
    ServoReport,
    ServoRequest,
    UNITLESS,
    Vector,
)

FLUSH_TIMEOUT = Duration(nanoseconds=300_000_000)
STATUS_TIMEOUT = 1.0  # [s] after which a status is history

DESCRIPTION = ('robot_description', 'robot_description_semantic', 'group', 'tip_link')
MOVEIT = ('move_group_name', 'command_in_type', 'scale.linear', 'scale.rotational', 'scale.joint')
PREFIX = 'moveit_servo.'
NAMES = (*DESCRIPTION, *(PREFIX + name for name in MOVEIT))
"""Parameters to request; MoveIt's servo node has some of them, that of arm_servo others."""

RETRY_PERIOD = 3.0  # [s]


class ServoSettings:
    """Reads parameters of the servo; repeats the request until it answers."""

    def __init__(self, node: Node, servo: str, changed: Callable[[], None]) -> None:
        self._client = node.create_client(GetParameters, f'{servo}/get_parameters')
        self._changed = changed
        self._values: dict[str, Any] = {}
        self._unanswered = set(NAMES)
        self._asked = -math.inf

    def serve(self, now: float) -> None:
        """Send a pending request if it is due at time ``now`` in [s]."""
        is_due = self._unanswered and now >= self._asked + RETRY_PERIOD
        if not is_due or not self._client.service_is_ready():
            return
        self._asked = now
        for name in self._unanswered:  # one by one: an unknown one empties the answer
            future = self._client.call_async(GetParameters.Request(names=[name]))
            future.add_done_callback(partial(self._take, name))

    def scales(self) -> Scales:
        """Return the servo's full speeds; missing ones default to those of moveit_servo."""
        default = Scales()
        return Scales(
            self._positive('scale.linear', default.linear),
            self._positive('scale.rotational', default.rotational),
            self._positive('scale.joint', default.joint),
            self._values.get(PREFIX + 'command_in_type', UNITLESS) == UNITLESS,
        )

    def names(self, urdf: str) -> ArmNames:
        """Return the names of the arm's parts; ``urdf`` is used if the servo has no description.

        Raises:
            ModelError: The descriptions do not define an arm.
        """
        if self._unanswered:
            values = {}
        else:
            values = {
                name: value for name, value in self._values.items() if isinstance(value, str)
            }
        description = values.get('robot_description') or urdf
        if not description:
            raise ModelError('no robot description yet')
        group = values.get('group') or values.get(PREFIX + 'move_group_name', '')
        semantic = values.get('robot_description_semantic', '')
        return names_of(description, semantic, group, values.get('tip_link', ''))

    def _take(self, name: str, future: Any) -> None:  # noqa: ANN401  # rclpy's Future
        values = future.result().values
        if values and values[0].type != ParameterType.PARAMETER_NOT_SET:
            self._values[name] = parameter_value_to_python(values[0])
        if name in self._unanswered:
            self._unanswered.remove(name)
            if not self._unanswered:
                self._changed()

    def _positive(self, name: str, default: float) -> float:
        value = self._values.get(PREFIX + name, default)
        return value if isinstance(value, float) and 0.0 < value < math.inf else default


class ServoLink:
    """Publishes jogs, and reads the names of the arm's parts from the servo or the robot.

    Attributes:
        say: Shows the person a message.
        names: Names of the arm's parts that are known so far.
        scales: Full speeds of the servo.
        paused: Whether the person paused the servo.
        stream: Decides when to publish.
    """

    def __init__(self, node: Node, say: Callable[[str], None]) -> None:
        """Declare the parameters (servo, rate), advertise and subscribe.

        Raises:
            ParameterError: A value has the wrong type or is out of range.
        """
        read = ParameterReader(node)
        servo = read.text('servo', 'servo_node', 'name of the servo node')
        self._frames = (
            read.text('base_frame', '', "base frame; empty takes the arm's base link"),
            read.text('tool_frame', '', "tool frame; empty takes the arm's tip link"),
        )
        rate = read.number('rate', 50.0, (10.0, 500.0), 'commands per second [Hz]')
        self.stream: CommandStream[Jog] = CommandStream(1.0 / rate, rest_of)
        self.say = say
        self.names = ArmNames((), *self._frames)
        self.scales = Scales()
        self.paused = False
        self._node = node
        self._urdf = ''
        self._report: tuple[ServoReport, float] | None = None
        self._complained = ''
        self._twist = node.create_publisher(TwistStamped, f'{servo}/delta_twist_cmds', 10)
        self._jog = node.create_publisher(JointJogMessage, f'{servo}/delta_joint_cmds', 10)
        self._settings = ServoSettings(node, servo, self._learn)
        self._switch = node.create_client(ServoCommandType, f'{servo}/switch_command_type')
        self._pause = node.create_client(SetBool, f'{servo}/pause_servo')
        self._stop = node.create_client(Trigger, 'stop')
        node.create_subscription(ServoStatus, f'{servo}/status', self._take_status, 10)
        node.create_subscription(String, 'robot_description', self._take_description, LATCHED)
        node.create_subscription(JointState, 'joint_states', self._take_joints, 10)

    @property
    def has_subscriber(self) -> bool:
        """Whether the commands have a subscriber."""
        return any(each.get_subscription_count() for each in (self._twist, self._jog))

    def report(self, now: float) -> ServoReport | None:
        """Return the servo's latest status; None if it is too old."""
        if self._report is None or now - self._report[1] > STATUS_TIMEOUT:
            return None
        return self._report[0]

    def serve(self, now: float) -> None:
        """Request parameters of the servo that are still unknown."""
        self._settings.serve(now)

    def publish(self, command: Jog) -> None:
        """Publish a motion, given in shares of full speed, or show why it cannot be sent."""
        jog = self.scales.to_message(command)
        if isinstance(jog, JointJog):
            self._publish_joint(jog)
            return
        frame = self.names.base if jog.frame is Frame.BASE else self.names.tool
        if not frame:
            self._complain(f'no {jog.frame.value} frame yet: there is no robot_description')
            return
        twist = TwistStamped()
        twist.header.stamp = self._node.get_clock().now().to_msg()
        twist.header.frame_id = frame
        twist.twist.linear = _vector(jog.linear)
        twist.twist.angular = _vector(jog.angular)
        self._twist.publish(twist)

    def handle(self, request: CommandType | ServoRequest, now: float) -> None:
        """Switch the command type, pause or resume, or stop the robot; its jog has ended."""
        match request:
            case CommandType():
                message = ServoCommandType.Request(command_type=int(request))
                self._call(self._switch, message, f'{request.name.lower()} commands')
            case ServoRequest.STOP_ROBOT:
                self._call(self._stop, Trigger.Request(), 'stop')
            case ServoRequest.TOGGLE_PAUSE:
                paused = not self.paused

                def granted() -> None:
                    self.paused = paused

                what = 'pause' if paused else 'go on'
                self._call(self._pause, SetBool.Request(data=paused), what, granted)

    def flush(self) -> None:
        """Wait until published messages have arrived; call it before the program ends."""
        for publisher in (self._twist, self._jog):
            publisher.wait_for_all_acked(FLUSH_TIMEOUT)

    def _publish_joint(self, jog: JointJog) -> None:
        if jog.joint >= len(self.names.joints):
            self._complain(f'joint {jog.joint + 1} has no name yet: no robot description')
            return
        message = JointJogMessage()
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.header.frame_id = self.names.base
        message.joint_names = [self.names.joints[jog.joint]]
        message.velocities = [jog.velocity]
        self._jog.publish(message)

    def _call(
        self,
        client: Any,  # noqa: ANN401
        request: Any,  # noqa: ANN401
        what: str,
        granted: Callable[[], None] = lambda: None,
    ) -> None:
        if not client.service_is_ready():
            self.say(f'{what}: there is no service {client.service_name}; is the robot running?')
            return

        def take(future: Any) -> None:  # noqa: ANN401  # rclpy's Future
            answer = future.result()
            if answer.success:
                granted()
            words = getattr(answer, 'message', '') or ('done' if answer.success else 'refused')
            self.say(f'{what}: {words}')

        client.call_async(request).add_done_callback(take)

    def _complain(self, text: str) -> None:
        if text != self._complained:
            self.say(text)
        self._complained = text

    def _learn(self) -> None:
        self.scales = self._settings.scales()
        self._name()

    def _name(self) -> None:
        try:
            names = self._settings.names(self._urdf)
        except ModelError as error:
            self._complain(str(error))
            return
        base, tool = self._frames
        self.names = ArmNames(names.joints, base or names.base, tool or names.tool)

    def _take_description(self, message: String) -> None:
        self._urdf = message.data
        self._name()

    def _take_joints(self, message: JointState) -> None:
        if not self.names.joints:
            self.names = ArmNames(tuple(message.name), self.names.base, self.names.tool)

    def _take_status(self, message: ServoStatus) -> None:
        self._report = (message.code, message.message), time.monotonic()


def _vector(vector: Vector) -> Vector3:
    x, y, z = vector
    return Vector3(x=x, y=y, z=z)
