# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The topics of a robot's state, whether it is on a serial line or in the log of one."""

from __future__ import annotations

from collections.abc import Callable
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import Odometry
from rclpy.node import Node
from sensor_msgs.msg import BatteryState, Imu, JointState
from std_msgs.msg import Float64, String
from tf2_msgs.msg import TFMessage

from message_templates import FastPublisher
from node_runner import LATCHED
from quad_description import RobotState
from quad_msgs.msg import FootContacts

from ..link import LinkState
from ..serial_robot import ObservedRobot, ROBOT
from . import messages
from .messages import LinkDiagnostic, robot_diagnostic
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


class RobotTopics:
    """Publishes joints, imu, odom, contacts, /tf, battery, servo problems and diagnostics."""

    def __init__(
        self,
        node: Node,
        robot: ObservedRobot,
        frames: Frames,
        deviations: Deviations,
        steady: Callable[[float], float] = lambda moment: moment,
    ) -> None:
        """Make the publishers; ``steady`` turns times of states into the monotonic clock [s]."""
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
        self._servos = node.create_publisher(String, 'servo_problem', LATCHED)
        self._servo_problem: str | None = None
        self._velocity_error = node.create_publisher(Float64, 'joint_velocity_error', LATCHED)

    def publish(self, state: RobotState) -> None:
        """Publish a report, in the thread that has it."""
        if state.servo_problem is not None and state.servo_problem != self._servo_problem:
            self._servo_problem = state.servo_problem
            self._servos.publish(String(data=state.servo_problem))
        # what a controller waits for comes first
        if (joints := state.joints) is not None:
            template, numbers = messages.joint_states(self._robot.names, joints)
            self._joint_states.publish(template, self._stamp(joints.time), numbers)
        imu, odometry = state.imu, state.odometry
        if imu is None or odometry is None:
            self._node.get_logger().error(
                f'no /imu, /odom, /foot_contacts and transforms: {state.imu_problem}; the joints '
                'are published, and the robot can lie down',
                throttle_duration_sec=WARN_PERIOD,
            )
            return
        deviations, frames, stamp = self._deviations, self._frames, self._stamp(state.time)
        for publisher, (template, numbers) in (
            (self._imu, messages.imu(imu, deviations, frames.imu)),
            (self._odom, messages.odometry(imu, odometry, deviations, frames)),
            (self._contacts, messages.foot_contacts(odometry)),
        ):
            publisher.publish(template, stamp, numbers)
        if frames.publish:
            template, numbers = messages.transforms(odometry, frames)
            self._tf.publish(template, stamp, numbers)

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
            commands: What became of joint commands; None where it is unknown.
        """
        state, status = self._robot.latest, self._robot.status()
        now = self._node.get_clock().now().to_msg()
        array = DiagnosticArray()
        array.header.stamp = now
        array.status = [self.link.describe(name, port, status, recording(''))]
        if commands is not None:
            array.status.append(commands)
        if state is not None:
            error, box = self._robot.gravity_error, recording(ROBOT)
            array.status.append(
                robot_diagnostic(name, port, state, status, gravity_error=error, recording=box)
            )
            self._battery.publish(messages.battery(state, now))
            if state.joints is not None:
                self._velocity_error.publish(Float64(data=state.joints.velocity_error))
        self._diagnostics.publish(array)

    def _stamp(self, moment: float) -> int:
        """Return a time of the robot's states on the clock of ROS [ns]."""
        age = round((time.monotonic() - self._steady(moment)) * 1e9)
        return max(self._node.get_clock().now().nanoseconds - age, 0)
