# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The node that has a robot written into a recording of Rerun."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticArray
from nav_msgs.msg import Odometry
from rcl_interfaces.msg import Log
from rclpy.node import Node
from rclpy.qos import qos_profile_sensor_data, QoSProfile
import rerun
from sensor_msgs.msg import BatteryState, Imu, JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage
from urdf_reader import DescriptionError, read_urdf, Transform

from node_runner import destroyed_when_refused, LATCHED, ParameterReader, refuse_misspelt

from ..exceptions import SinkError
from ..rerun_log import DIAGNOSTICS, layout, LEVELS, LOG, RobotLog

VIEWER = 'rerun+http://127.0.0.1:9876/proxy'
"""Where the program `rerun` listens."""
SUFFIX = '.rrd'
FLUSH_TIMEOUT = 10.0
"""What is waited for the viewer at the end in [s]."""
ROSOUT = QoSProfile(depth=1000)
LEVEL_NAMES = ('OK', 'WARN', 'ERROR', 'STALE')
"""Levels of diagnostic_msgs."""


class RerunSink(Node):
    """Writes what the topics say; each message with the time of its stamp."""

    @destroyed_when_refused
    def __init__(self, name: str) -> None:
        """Open the recording, and subscribe.

        Args:
            name: Of the node.

        Raises:
            ParameterError: A parameter is wrong.
            SinkError: The recording cannot be opened.
        """
        super().__init__(name)
        read = ParameterReader(self)
        to = read.text('to', VIEWER, f'a file that ends with {SUFFIX}, or the URL of a viewer')
        self._prefix = read.text('frame_prefix', '', 'before each frame, as of the robot on /tf')
        refuse_misspelt(self)
        self._stream = _opened(to)
        self._log = RobotLog(self._stream)
        self._root = ''
        self._statuses: dict[str, tuple[int, str]] = {}
        self.seen_at = f'the robot is written to {to}'
        sensor = qos_profile_sensor_data
        self.create_subscription(String, 'robot_description', self._describe, LATCHED)
        self.create_subscription(JointState, 'joint_states', self._take_joints, sensor)
        self.create_subscription(TFMessage, '/tf', self._take_transforms, sensor)
        self.create_subscription(Odometry, 'odom', self._take_odometry, sensor)
        self.create_subscription(Imu, 'imu', self._take_imu, sensor)
        self.create_subscription(BatteryState, 'battery_state', self._take_battery, sensor)
        self.create_subscription(DiagnosticArray, 'diagnostics', self._take_statuses, 10)
        self.create_subscription(Log, '/rosout', self._take_log, ROSOUT)
        try:
            contacts = import_module('quad_msgs.msg').FootContacts
        except ModuleNotFoundError:  # a machine that has only arms
            pass
        else:
            self.create_subscription(contacts, 'foot_contacts', self._take_contacts, sensor)
        self.get_logger().info(self.seen_at)

    def close(self) -> None:
        """Write what is left, and close the recording."""
        try:
            self._stream.flush(timeout_sec=FLUSH_TIMEOUT)
        except Exception as error:  # noqa: BLE001  # rerun does not say which there are
            self.get_logger().error(f'not all was sent, is there a viewer? {error}')
        self._stream.disconnect()

    def _describe(self, message: String) -> None:
        try:
            tree = read_urdf(message.data)
        except DescriptionError as error:
            self.get_logger().error(f'robot_description cannot be shown: {error}')
            return
        self._root = tree.root
        for note in self._log.describe(tree):
            self.get_logger().warning(f'not shown: {note}')

    def _take_joints(self, message: JointState) -> None:
        self._at(message.header.stamp)
        self._log.joints(dict(zip(message.name, message.position, strict=False)))
        for quantity in ('position', 'velocity', 'effort'):
            numbers = zip(message.name, getattr(message, quantity), strict=False)
            self._log.numbers(quantity, numbers)

    def _take_transforms(self, message: TFMessage) -> None:
        for each in message.transforms:
            if self._root and each.child_frame_id == f'{self._prefix}{self._root}':
                place, turn = each.transform.translation, each.transform.rotation
                self._at(each.header.stamp)
                self._log.base(
                    Transform((place.x, place.y, place.z), (turn.x, turn.y, turn.z, turn.w))
                )

    def _take_odometry(self, message: Odometry) -> None:
        self._at(message.header.stamp)
        linear, angular = message.twist.twist.linear, message.twist.twist.angular
        numbers = {'x': linear.x, 'y': linear.y, 'yaw': angular.z}
        self._log.numbers('odometry', numbers.items())

    def _take_imu(self, message: Imu) -> None:
        self._at(message.header.stamp)
        for quantity in ('angular_velocity', 'linear_acceleration'):
            vector = getattr(message, quantity)
            self._log.numbers(f'imu/{quantity}', ((axis, getattr(vector, axis)) for axis in 'xyz'))

    def _take_battery(self, message: BatteryState) -> None:
        self._at(message.header.stamp)
        numbers = {'percentage': message.percentage, 'voltage': message.voltage}
        self._log.numbers('battery', numbers.items())

    def _take_contacts(self, message: Any) -> None:  # noqa: ANN401  # its type may be missing
        self._at(message.header.stamp)
        self._log.numbers('contact', zip(message.name, map(float, message.contact), strict=False))

    def _take_statuses(self, message: DiagnosticArray) -> None:
        self._at(message.header.stamp)
        for status in message.status:
            level = int.from_bytes(status.level, 'little')
            if self._statuses.get(status.name) != (level, status.message):
                self._statuses[status.name] = level, status.message
                name = LEVEL_NAMES[min(level, len(LEVEL_NAMES) - 1)]
                self._log.text(DIAGNOSTICS, name, f'{status.name}: {status.message}')

    def _take_log(self, message: Log) -> None:
        self._at(message.stamp)
        self._log.text(LOG, LEVELS.get(message.level, 'INFO'), f'{message.name}: {message.msg}')

    def _at(self, stamp: Time) -> None:
        """Let what comes have a stamp; a message without one has the time of its arrival."""
        found = stamp.sec * 1_000_000_000 + stamp.nanosec
        self._log.at(found or self.get_clock().now().nanoseconds)


def _opened(to: str) -> rerun.RecordingStream:
    """Open a recording.

    Args:
        to: A file, or the URL of a viewer.

    Raises:
        SinkError: It is neither, or the file cannot be written.
    """
    path = Path(to)
    try:
        stream = rerun.RecordingStream('robot')
        if to.startswith(('rerun://', 'rerun+http://', 'rerun+https://')):
            stream.connect_grpc(to, default_blueprint=layout())
            return stream
        _check(path)
        stream.save(path, default_blueprint=layout())
    except SinkError:
        raise
    except Exception as error:  # rerun does not say which there are
        raise SinkError(f'{to}: {error}') from error
    return stream


def _check(path: Path) -> None:
    """Refuse what is no new file of Rerun.

    Raises:
        SinkError: With the reason.
    """
    if path.suffix != SUFFIX:
        raise SinkError(
            f'{str(path)!r} is neither a file that ends with {SUFFIX} nor the URL of a viewer; '
            f'start `rerun`, which listens at {VIEWER}'
        )
    if path.exists():
        raise SinkError(f'{path} is there already; give another name')
    if not path.parent.is_dir():
        raise SinkError(f'{path}: there is no folder {path.parent}')
