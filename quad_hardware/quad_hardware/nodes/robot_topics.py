# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The topics of a robot's state, whether it is on a serial line or in the log of one."""

from __future__ import annotations

from collections.abc import Callable
import time
from typing import Protocol as Interface

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import BatteryState, Imu, JointState
from tf2_msgs.msg import TFMessage

from message_templates import FastPublisher
from quad_description import RobotState
from quad_msgs.msg import FootContacts

from ..estimation import Health, OdometryState
from ..link import LinkState, LinkStatus
from ..report import Report
from ..serial_robot import ROBOT
from . import messages
from .diagnostics import LinkDiagnostic, robot_diagnostic
from .parameters import Deviations, Frames

SENSOR_DEPTH = 10  # reliable, which best-effort subscribers can receive as well
WARN_PERIOD = 2.0  # [s] between two warnings of the same kind


def log_link(node: Node, state: LinkState, detail: str) -> None:
    """Log how a link is."""
    if state in {LinkState.REFUSED, LinkState.FAILED}:
        node.get_logger().error(f'{state.value}: {detail}')
    elif state in {LinkState.STALE, LinkState.CONNECTING}:
        node.get_logger().warning(f'{state.value}: {detail}')
    elif state is LinkState.STOPPED:
        node.get_logger().debug(detail)
    else:
        node.get_logger().info(f'{state.value}: {detail}')


class ObservedRobot(Interface):
    """What is published of a robot."""

    names: tuple[str, ...]  # joints in the order of the URDF

    @property
    def latest(self) -> tuple[Report, RobotState] | None:
        """The newest report and its state; None while there is none."""

    def status(self) -> LinkStatus:
        """Return how the link is."""

    def health(self) -> Health:
        """Return how the robot is."""

    def update_odometry(self, state: RobotState) -> OdometryState | None:
        """Return where the body is by a state, to be called once for each."""


class RobotTopics:
    """Publishes joints, imu, odom, foot_contacts, /tf, battery_state and diagnostics."""

    def __init__(
        self,
        node: Node,
        robot: ObservedRobot,
        frames: Frames,
        deviations: Deviations,
        steady: Callable[[float], float] = lambda moment: moment,
    ) -> None:
        """Make the publishers.

        Args:
            steady: Returns when a time of the robot's states is, on the monotonic clock [s].
        """
        self.link = LinkDiagnostic()  # what is said of the serial link
        self._node, self._robot = node, robot
        self._frames, self._deviations = frames, deviations
        self._steady = steady
        self._joint_states = FastPublisher(
            node.create_publisher(JointState, 'joint_states', SENSOR_DEPTH)
        )
        self._imu = FastPublisher(node.create_publisher(Imu, 'imu', SENSOR_DEPTH))
        self._odom = FastPublisher(node.create_publisher(Odometry, 'odom', SENSOR_DEPTH))
        self._contacts = FastPublisher(
            node.create_publisher(FootContacts, 'foot_contacts', SENSOR_DEPTH)
        )
        self._battery = node.create_publisher(BatteryState, 'battery_state', SENSOR_DEPTH)
        self._tf = FastPublisher(node.create_publisher(TFMessage, '/tf', 100))
        self._diagnostics = node.create_publisher(DiagnosticArray, 'diagnostics', SENSOR_DEPTH)

    def publish(self, state: RobotState) -> None:
        """Publish a report, in the thread that has it."""
        # what a controller waits for comes first
        if (joints := state.joints) is not None:
            self._joint_states.publish(
                messages.joint_states_template(self._robot.names, joints),
                self._stamp(joints.time),
                messages.joint_numbers(joints),
            )
        odometry = self._robot.update_odometry(state)
        if state.imu is None or odometry is None:
            self._node.get_logger().error(
                f'no /imu, /odom, /foot_contacts and transforms: '
                f'{self._robot.health().imu_problem}; the joints are published, and the robot can '
                'lie down',
                throttle_duration_sec=WARN_PERIOD,
            )
            return
        deviations, frames, stamp = self._deviations, self._frames, self._stamp(state.time)
        self._imu.publish(
            messages.imu_template(state.imu, deviations, frames.imu),
            stamp,
            messages.imu_numbers(state.imu),
        )
        self._odom.publish(
            messages.odometry_template(state.imu, deviations, frames),
            stamp,
            messages.odometry_numbers(state.imu, odometry, frames),
        )
        self._contacts.publish(messages.foot_contacts_template(odometry), stamp, ())
        if frames.publish:
            self._tf.publish(
                messages.transforms_template(frames),
                stamp,
                messages.transforms_numbers(odometry, frames),
            )

    def publish_diagnostics(
        self,
        name: str,
        port: str,
        recording: Callable[[str], str],
        commands: DiagnosticStatus | None = None,
    ) -> None:
        """Publish how link and robot are, and the battery.

        Args:
            name: Name of the node that has the robot.
            port: Its serial port, or what is in the place of one.
            recording: Returns the last file of the black box, maybe of one subject.
            commands: What became of joint commands; None where nobody knows.
        """
        latest = self._robot.latest
        now = self._node.get_clock().now().to_msg()
        array = DiagnosticArray()
        array.header.stamp = now
        array.status = [self.link.describe(name, port, self._robot.status(), recording(''))]
        if commands is not None:
            array.status.append(commands)
        if latest is not None:
            report, state = latest
            health = self._robot.health()
            array.status.append(
                robot_diagnostic(
                    name,
                    port,
                    report,
                    health,
                    signs_checked=state.imu is not None and not state.imu.is_uncertain,
                    recording=recording(ROBOT),
                )
            )
            self._battery.publish(messages.battery(health.battery, now))
        self._diagnostics.publish(array)

    def _stamp(self, moment: float) -> int:
        """Return a time of the robot's states on the clock of ROS [ns]."""
        age = round((time.monotonic() - self._steady(moment)) * 1e9)
        return max(self._node.get_clock().now().nanoseconds - age, 0)
