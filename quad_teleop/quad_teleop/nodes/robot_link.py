# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The robot as teleop programs command it: topics, requests to the controller, its reports."""

from __future__ import annotations

from collections.abc import Callable
import math
import time

from diagnostic_msgs.msg import DiagnosticArray
from geometry_msgs.msg import Point, Pose, Quaternion, Twist, TwistStamped, Vector3
from rclpy.duration import Duration
from rclpy.node import Node
from std_srvs.srv import Trigger

from node_runner import ParameterReader
from quad_msgs.srv import SetMode

from ..exceptions import SettingError
from ..motion import BodyPose, Mode, RobotRequest, Velocity
from ..status import ControllerReport, read_report
from .command_client import CommandClient, KEY_REPEAT_TIME

FLUSH_TIMEOUT = Duration(nanoseconds=300_000_000)


class RobotLink:
    """Publishes velocities as Twist, TwistStamped or both, and poses of the body.

    Client of ``set_mode``, ``stop`` and ``controller_node/clear_fault``; reads /diagnostics.

    Attributes:
        say: Shows the person answers, and why there is none.
        mode: The mode that was granted last; None before.
    """

    def __init__(self, node: Node, say: Callable[[str], None]) -> None:
        """Declare the parameters of the topics, and connect.

        Raises:
            ParameterError: A value is of another kind.
            SettingError: Neither kind of message is wanted.
        """
        read = ParameterReader(node)
        twist = read.flag('twist', 'publish cmd_vel (Twist)', default=True)
        stamped = read.flag('stamped', 'publish cmd_vel_stamped (TwistStamped)', default=False)
        if not (twist or stamped):
            raise SettingError('twist and stamped are both false: nothing would be published')
        self.say = say
        self.mode: Mode | None = None
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
        """Whether anybody listens to the velocities."""
        return any(publisher.get_subscription_count() for publisher in self._publishers)

    def report(self, now: float) -> ControllerReport | None:
        """Return what the controller reported last; None when that is long ago."""
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

        Each stop is sent; a mode that was requested before is not any more.
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
        """Send and give up the requests that are due."""
        for client in (self._modes, self._faults, self._stops):
            client.check(now)

    def flush(self) -> None:
        """Wait until the last velocities have arrived, for a while at most."""
        for publisher in self._publishers:
            publisher.wait_for_all_acked(FLUSH_TIMEOUT)

    def _say_once(self, text: str) -> None:
        """Show an answer, but not again for each repetition of a key that is held."""
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
