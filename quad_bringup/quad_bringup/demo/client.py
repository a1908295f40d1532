# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The demo's ROS client: commands velocities, requests modes, and observes what comes of it."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
import math
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import Quaternion, Twist
from nav_msgs.msg import Odometry
from rclpy.qos import qos_profile_sensor_data, QoSProfile
from sensor_msgs.msg import BatteryState, Imu, JointState

from quad_description.rotations import tilt_of
from quad_msgs.msg import JointCommand

from ..mode_client import ModeClient
from .figures import Figures, UNKNOWN
from .period_statistics import PeriodStatistics
from .scenario import Milestones
from .segments import STANDSTILL, Velocity
from .track import Pose, Track

COMMAND_PERIOD = 0.1
"""Time in [s] between two velocity commands; the controller's time-out is 0.5 s."""
LOOP_PERIOD = 0.02
"""Period of the controller in [s]."""
CONTROLLER = 'controller_node'
"""Node whose errors in /diagnostics have the reason it is in a fault."""
FAULT = 'fault'
"""State of the controller after an error."""
COMMAND_QOS = QoSProfile(depth=1)
"""Of /joint_command: reliable, only the latest."""


class QuadClient(ModeClient):
    """Commands, and receives everything; use it in one thread."""

    def __init__(
        self,
        joints: Sequence[str],
        ground_truth: str,
        given_up: Callable[[], bool],
        namespace: str = '',
    ) -> None:
        """Join the ROS graph.

        Args:
            joints: Names of the joints, in the order of /joint_command.
            ground_truth: Topic on which the simulator publishes where the body is.
            given_up: True when nothing shall be waited for any more.
            namespace: That of the robot.
        """
        super().__init__('demo', given_up, namespace)
        self._joints = list(joints)
        self._truth, self._odometry = Track(), Track()
        self._periods = PeriodStatistics(LOOP_PERIOD)
        self._commanded: Velocity | None = None
        self._reason = ''
        self._height = self._tilt = self._tilt_max = self._battery = math.nan
        self._targets: Mapping[str, float] = {}
        self._positions: Mapping[str, float] = {}
        self._twist = self.node.create_publisher(Twist, 'cmd_vel', 1)
        self.node.create_timer(COMMAND_PERIOD, self._send)
        self._subscribe(ground_truth)

    def _subscribe(self, ground_truth: str) -> None:
        sensor = qos_profile_sensor_data
        topics: Iterable[tuple[Any, str, Callable[[Any], None], Any]] = (
            (Odometry, ground_truth, self._take_truth, sensor),
            (Odometry, 'odom', self._take_odometry, sensor),
            (Imu, 'imu', self._take_imu, sensor),
            (JointState, 'joint_states', self._take_joints, sensor),
            (BatteryState, 'battery_state', self._take_battery, sensor),
            (JointCommand, 'joint_command', self._take_targets, COMMAND_QOS),
            (DiagnosticArray, 'diagnostics', self._take_diagnostics, 50),
        )
        for kind, topic, callback, qos in topics:
            self.node.create_subscription(kind, topic, callback, qos)

    @property
    def figures(self) -> Figures:
        """What was received last."""
        return Figures(
            state=self.state or UNKNOWN,
            fault=self._reason if self.state.endswith(FAULT) else '',
            commanded=self._commanded or STANDSTILL,
            measured=self._truth.velocity,
            odometry=self._odometry.velocity,
            height=self._height,
            tilt=self._tilt,
            tilt_max=self._tilt_max,
            targets=self._targets,
            positions=self._positions,
            periods=self._periods.figures(),
            battery=self._battery,
        )

    @property
    def milestones(self) -> Milestones:
        """What the body has covered so far."""
        return Milestones(self._truth.milestone, self._odometry.milestone)

    @property
    def missing(self) -> list[str]:
        """What is needed and not there yet: topics without publisher or subscriber."""
        there = {
            'ground truth of the simulator': self._truth.milestone is not None,
            '/odom': self._odometry.milestone is not None,
            '/imu': math.isfinite(self._tilt),
            '/joint_states': bool(self._positions),
            '/joint_command': bool(self._targets),
            'a subscriber of /cmd_vel': self._twist.get_subscription_count() > 0,
        }
        return [name for name, is_there in there.items() if not is_there]

    def command(self, velocity: Velocity | None) -> None:
        """Command a velocity from now on, ten times a second.

        Args:
            velocity: What to command; None to be silent.
        """
        self._commanded = velocity
        self._send()

    def watch_tilt(self) -> None:
        """Measure the greatest tilt, and the periods of the loop, from now on."""
        self._tilt_max = self._tilt
        self._periods = PeriodStatistics(LOOP_PERIOD)

    def _send(self) -> None:
        if self._commanded is None:
            return
        twist = Twist()
        twist.linear.x, twist.linear.y = self._commanded.forward, self._commanded.left
        twist.angular.z = self._commanded.turn
        self._twist.publish(twist)

    def _take_truth(self, message: Odometry) -> None:
        pose = _pose(message)
        self._truth.take(pose)
        self._height = pose.z

    def _take_odometry(self, message: Odometry) -> None:
        self._odometry.take(_pose(message))

    def _take_imu(self, message: Imu) -> None:
        self._tilt = tilt_of(_rotation(message.orientation))
        self._tilt_max = max(self._tilt, self._tilt_max)

    def _take_joints(self, message: JointState) -> None:
        self._positions = dict(zip(message.name, message.position, strict=False))

    def _take_battery(self, message: BatteryState) -> None:
        self._battery = 100.0 * message.percentage

    def _take_targets(self, message: JointCommand) -> None:
        self._periods.take(_seconds(message.header.stamp))
        self._targets = dict(zip(self._joints, message.position, strict=False))

    def _take_diagnostics(self, message: DiagnosticArray) -> None:
        for status in message.status:
            if status.name.startswith(CONTROLLER) and status.level == DiagnosticStatus.ERROR:
                self._reason = status.message


def _seconds(stamp: Time) -> float:
    return float(stamp.sec + 1e-9 * stamp.nanosec)


def _rotation(quaternion: Quaternion) -> tuple[float, float, float, float]:
    return (quaternion.x, quaternion.y, quaternion.z, quaternion.w)


def _pose(message: Odometry) -> Pose:
    position = message.pose.pose.position
    rotation = _rotation(message.pose.pose.orientation)
    return Pose(_seconds(message.header.stamp), position.x, position.y, position.z, rotation)
