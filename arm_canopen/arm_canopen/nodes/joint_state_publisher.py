# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Publishes joint states of drives and of their robot, stamped with the time of the SYNC.

``ros2 run arm_canopen canopen_joint_state_publisher`` merges those of several masters.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
import math
import sys
import time
from typing import TYPE_CHECKING

from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from canopen_core import CanopenError
from canopen_core.standard import EncoderObject
from node_runner import (
    destroyed_when_refused,
    LATCHED,
    notify_ready,
    ParameterReader,
    refuse_misspelt,
    run_node,
)

from ..joints import JointAggregator, Joints, JointSample, JointSet, movable_joints, SilenceWatch
from .output_thread import OutputThread

if TYPE_CHECKING:
    from ..cia402.state import AxisState
    from ..master.process_image import InputReader
    from ..master.remote_node import RemoteNode
    from ..master.runner import NetworkThread


class EncoderState:
    """An encoder as an axis: position and velocity in user units."""

    effort = 0.0  # of a joint without a motor

    def __init__(self, device: RemoteNode, thread: NetworkThread) -> None:
        self.name = device.name
        self._scales = device.config.drive
        self._device, self._thread = device, thread
        self._position = device.image.reader(EncoderObject.POSITION)
        self._speed = device.image.reader(EncoderObject.SPEED, 1)

    @property
    def fresh(self) -> bool:
        """Whether the position is recent enough to be published."""
        reader = self._position
        return (
            self._device.online
            and reader is not None
            and not reader.source.stale(self._thread.now())
        )

    @property
    def position(self) -> float:
        """Position; NaN while it is unknown."""
        scales = self._scales
        return _value(self._position) * scales.scale_pos_from_dev + scales.offset_pos_from_dev

    @property
    def velocity(self) -> float:
        """Velocity; NaN while no TPDO brings the speed (0x6030:01)."""
        speed = self._speed
        if speed is None or speed.source.stale(self._thread.now()):
            return math.nan
        return _value(speed) * self._scales.scale_vel_from_dev


def _value(reader: InputReader | None) -> float:
    value = None if reader is None else reader.value
    return math.nan if value is None else value


class DriveJointStates:
    """Publishes ``~/joint_states`` of a drive, and those of each channel if it has several."""

    def __init__(self, node: Node, axes: Sequence[AxisState | EncoderState]) -> None:
        self.axes = list(axes)  # the state of each axis
        self.listened = False  # one of the topics has subscribers
        names = [axis.name for axis in axes]
        topics = {'~': slice(None)}
        if len(names) > 1:  # and each channel as a drive of its own
            topics |= {name: slice(number, number + 1) for number, name in enumerate(names)}
        self._topics: list[tuple[Publisher, JointState, slice]] = []
        for place, part in topics.items():
            zeros = [0.0] * len(names[part])
            message = JointState(name=names[part], position=zeros, velocity=zeros, effort=zeros)
            publisher = node.create_publisher(JointState, f'{place}/joint_states', 10)
            self._topics.append((publisher, message, part))

    def update_listeners(self) -> None:
        """Check for subscribers."""
        self.listened = any(publisher.get_subscription_count() for publisher, _, _ in self._topics)

    def sample(self) -> list[JointSample] | None:
        """Return the state of each axis; None while one is not fresh."""
        if not all(axis.fresh for axis in self.axes):
            return None
        return [JointSample(axis.position, axis.velocity, axis.effort) for axis in self.axes]

    def publish(self, stamp: Time, samples: Sequence[JointSample]) -> None:
        """Publish the state of the axes at the time of a SYNC."""
        for publisher, message, axes in self._topics:
            message.header.stamp = stamp.to_msg()
            for number, sample in enumerate(samples[axes]):
                message.position[number], message.velocity[number], message.effort[number] = sample
            publisher.publish(message)


class RobotJointStates:
    """Publishes ``joint_states`` of a robot, merged from those of its drives."""

    def __init__(self, node: Node, joints: Joints) -> None:
        self.aggregator = JointAggregator(joints)  # the joints
        self.listened = False  # the topic has subscribers
        self._clock = node.get_clock()
        self._publisher = node.create_publisher(JointState, 'joint_states', 10)

    def set_joints(self, joints: Joints) -> None:
        """Restart with other joints, or with the same in another order."""
        self.aggregator = JointAggregator(joints)

    def update_listeners(self) -> None:
        """Check for subscribers."""
        self.listened = self._publisher.get_subscription_count() > 0

    def update(self, joint: str, stamp: int, sample: JointSample) -> None:
        """Store a joint sample with its stamp in [ns], and publish each complete set."""
        for ready in self.aggregator.update(joint, stamp, sample, time.monotonic()):
            if ready.samples:
                self._publish(ready)

    def _publish(self, ready: JointSet) -> None:
        positions, velocities, efforts = zip(*ready.samples.values(), strict=True)
        names = [*ready.samples]
        message = JointState(name=names, position=positions, velocity=velocities, effort=efforts)
        # drivers that leave the stamp empty, as ros2_canopen does, get the time of arrival
        stamp = Time(nanoseconds=ready.stamp) if ready.stamp else self._clock.now()
        message.header.stamp = stamp.to_msg()
        self._publisher.publish(message)


class BusJointStates:
    """Samples the joint states of a bus in the cycle; the output thread publishes them."""

    def __init__(
        self, node: Node, drives: Sequence[DriveJointStates], output: OutputThread
    ) -> None:
        self._node = node
        self._drives = list(drives)
        self._output = output
        self._robot: RobotJointStates | None = None
        self._posted = False

    def publish_robot(self, description: str) -> None:
        """Also publish ``joint_states`` of all axes of the bus and the joints that mimic them.

        The description is a URDF in XML, or comes from the topic ``robot_description``. Until
        then, and if it has none of the joints, they are those of bus.yml in its order.
        """
        own = [axis.name for drive in self._drives for axis in drive.axes]
        robot = RobotJointStates(self._node, dict.fromkeys(own))

        def begin(joints: Joints) -> None:
            here = {
                name: mimic
                for name, mimic in joints.items()
                if name in own or (mimic is not None and mimic.source in own)
            }
            absent = [name for name in own if name not in joints]
            if not here:
                self._node.get_logger().error(
                    f'joint_states: no drive of bus.yml is a joint of the URDF; bus.yml has '
                    f'{", ".join(own)}, the URDF has {", ".join(joints)}; those of bus.yml are '
                    'published'
                )
                return
            if absent:
                self._node.get_logger().warning(
                    f'joint_states: {", ".join(absent)} of bus.yml are no joints of the URDF, and '
                    'are left out'
                )
            self._output.post(lambda: robot.set_joints(here))

        on_description(self._node, description, begin)
        self._robot = robot

    def update_listeners(self) -> None:
        """Check which topics have subscribers; the others are not published."""
        for drive in self._drives:
            drive.update_listeners()
        if self._robot is not None:
            self._robot.update_listeners()

    def feedback(self, sync_time: float) -> None:
        """Sample the axes at the steady time of a SYNC in [s]."""
        if self._posted:
            return  # the output thread is behind; it gets the newest when it is there again
        all_of_them = self._robot is not None and self._robot.listened
        samples = [
            (drive, sample)
            for drive in self._drives
            if (all_of_them or drive.listened) and (sample := drive.sample()) is not None
        ]
        if samples:
            self._posted = True
            self._output.post(partial(self._publish, sync_time, samples))

    def _publish(
        self, sync_time: float, samples: list[tuple[DriveJointStates, list[JointSample]]]
    ) -> None:
        self._posted = False
        age = int((time.monotonic() - sync_time) * 1e9)  # [ns]
        stamp = Time(nanoseconds=self._node.get_clock().now().nanoseconds - age)
        for drive, sample in samples:
            if drive.listened:
                drive.publish(stamp, sample)
        if self._robot is not None:
            for drive, sample in samples:
                for axis, joint in zip(drive.axes, sample, strict=True):
                    self._robot.update(axis.name, stamp.nanoseconds, joint)


def on_description(node: Node, text: str, begin: Callable[[Joints], None]) -> None:
    """Call ``begin`` once with the movable joints of the robot description.

    The description is ``text`` (URDF in XML), or comes from the topic ``robot_description``.

    Raises:
        CanopenError: The text is no URDF.
    """
    if text:
        try:
            joints = movable_joints(text)
        except CanopenError as error:
            raise CanopenError(f'robot_description: {error}') from error
        begin(joints)
        return
    begun = False

    def receive(message: String) -> None:
        nonlocal begun
        if begun:
            return  # a robot that changes its joints is another robot, for another process
        try:
            joints = movable_joints(message.data)
        except CanopenError as error:
            node.get_logger().error(f'robot_description: {error}')
        else:
            begun = True
            begin(joints)

    node.create_subscription(String, 'robot_description', receive, LATCHED)


WATCH_PERIOD = 2.0  # [s] between two looks for joints without states


class JointStatePublisher(Node):
    """Subscribes to ``/<joint>/joint_states`` of all joints and publishes ``/joint_states``."""

    @destroyed_when_refused
    def __init__(self) -> None:
        """Read the robot description and subscribe.

        Raises:
            ParameterError: A parameter is misspelt or has the wrong type.
            CanopenError: The robot description is no URDF.
        """
        super().__init__('canopen_joint_state_publisher')
        description = ParameterReader(self).text(
            'robot_description',
            '',
            'URDF as XML text; without it, the topic robot_description',
        )
        refuse_misspelt(self)
        if not description:
            self.get_logger().info('waiting for the URDF on the topic robot_description')
        on_description(self, description, self._begin)

    def _begin(self, joints: Joints) -> None:
        self._robot = RobotJointStates(self, joints)
        moved = [name for name, mimic in joints.items() if mimic is None]
        self._watch = SilenceWatch(moved, time.monotonic())
        self._missing: list[str] = []
        for joint in joints:
            self._listen_to(joint)
        self.create_timer(WATCH_PERIOD, self._report_silence)
        self.get_logger().info(f'publishing {len(joints)} joints: {", ".join(joints)}')
        notify_ready()

    def _listen_to(self, joint: str) -> None:
        topic = f'{joint}/joint_states'
        try:
            self.create_subscription(JointState, topic, partial(self._take, joint), 10)
        except InvalidTopicNameException:
            self.get_logger().error(
                f'joint {joint!r} cannot be the name of a ROS topic, so no drive reports it; it '
                'may have letters, digits and _, beginning with a letter'
            )

    def _take(self, joint: str, message: JointState) -> None:
        if joint not in message.name:
            return  # a drive of several axes names another one in this message
        index = message.name.index(joint)
        if index >= len(message.position):
            self.get_logger().warning(f'{joint}: message without a position', once=True)
            return
        stamp = message.header.stamp.sec * 1_000_000_000 + message.header.stamp.nanosec
        velocity = message.velocity[index] if index < len(message.velocity) else 0.0
        effort = message.effort[index] if index < len(message.effort) else 0.0
        sample = JointSample(message.position[index], velocity, effort)
        self._watch.note(joint)
        self._robot.update(joint, stamp, sample)

    def _report_silence(self) -> None:
        now = time.monotonic()
        silent = self._robot.aggregator.silent(now)
        published = [name for name in silent if self.count_publishers(f'{name}/joint_states')]
        missing = self._watch.look(silent, published, now)
        if missing and missing != self._missing:
            self.get_logger().warning(
                f'no joint states of {", ".join(missing)}; they are left out of /joint_states. Is '
                'there a drive of that name in bus.yml, and is it operational?'
            )
        elif self._missing and not silent:
            self.get_logger().info('joint states of all joints again')
        self._missing = missing


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_node('canopen_joint_state_publisher', JointStatePublisher, CanopenError)


if __name__ == '__main__':
    sys.exit(main())
