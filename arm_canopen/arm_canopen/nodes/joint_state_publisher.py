# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_canopen canopen_joint_state_publisher``: the drives' states as /joint_states."""

from __future__ import annotations

from functools import partial
import sys
import time

from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_msgs.msg import String

from node_runner import (
    destroyed_when_refused,
    notify_ready,
    ParameterReader,
    refuse_misspelt,
    run_node,
)

from ..exceptions import CanopenError
from ..joints.aggregator import JointAggregator, JointSample, JointSet
from ..joints.robot_joints import movable_joints

LATCHED = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
WATCH_PERIOD = 2.0  # [s] between two looks for joints that are silent


class JointStatePublisher(Node):
    """Subscribes ``/<joint>/joint_states`` of all joints and publishes ``/joint_states``."""

    @destroyed_when_refused
    def __init__(self) -> None:
        """Read the robot description and subscribe.

        Raises:
            ParameterError: A parameter is misspelt, or no text.
            CanopenError: The robot description is no URDF.
        """
        super().__init__('canopen_joint_state_publisher')
        description = ParameterReader(self).text(
            'robot_description',
            '',
            'URDF as XML text; without it, the topic robot_description tells it',
        )
        refuse_misspelt(self)
        self._begun = False
        self._aggregator = JointAggregator([])
        self._silent: list[str] = []
        self._publisher = self.create_publisher(JointState, 'joint_states', 10)
        if description:
            self._begin(description)
        else:
            self.create_subscription(String, 'robot_description', self._take_description, LATCHED)
            self.get_logger().info('waiting for the URDF on the topic robot_description')

    def _take_description(self, message: String) -> None:
        if self._begun:
            return  # a robot that changes its joints is another robot, for another process
        try:
            self._begin(message.data)
        except CanopenError as error:
            self.get_logger().error(f'robot_description: {error}')

    def _begin(self, description: str) -> None:
        joints = movable_joints(description)
        self._begun = True
        self._aggregator = JointAggregator(joints)
        for joint in joints:
            self._listen_to(joint.name)
        self.create_timer(WATCH_PERIOD, self._watch)
        names = ', '.join(joint.name for joint in joints)
        self.get_logger().info(f'publishing {len(joints)} joints: {names}')
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
        for ready in self._aggregator.update(joint, stamp, sample, time.monotonic()):
            self._publish(ready)

    def _publish(self, ready: JointSet) -> None:
        positions, velocities, efforts = zip(*ready.samples, strict=True)
        message = JointState(
            name=ready.names, position=positions, velocity=velocities, effort=efforts
        )
        # drivers that leave the stamp empty, as ros2_canopen does, get the time of arrival
        clock = self.get_clock()
        stamp = Time(nanoseconds=ready.stamp) if ready.stamp else clock.now()
        message.header.stamp = stamp.to_msg()
        self._publisher.publish(message)

    def _watch(self) -> None:
        silent = self._aggregator.silent(time.monotonic())
        if silent and silent != self._silent:
            self.get_logger().warning(
                f'nothing heard of {", ".join(silent)}; is there a drive of that name in bus.yml, '
                'and is it operational? They are left out of /joint_states'
            )
        elif self._silent and not silent:
            self.get_logger().info('all joints are heard')
        self._silent = silent


def main() -> int:
    """Run until Ctrl-C; return the exit code."""
    return run_node('canopen_joint_state_publisher', JointStatePublisher, CanopenError)


if __name__ == '__main__':
    sys.exit(main())
