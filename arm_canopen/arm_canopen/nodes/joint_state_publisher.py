# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_canopen canopen_joint_state_publisher``: the drives' states as /joint_states."""

from __future__ import annotations

from functools import partial
import sys
import time

from rclpy.exceptions import InvalidTopicNameException
from rclpy.node import Node
from sensor_msgs.msg import JointState

from canopen_core import CanopenError
from node_runner import (
    destroyed_when_refused,
    notify_ready,
    ParameterReader,
    refuse_misspelt,
    run_node,
)

from ..joints import Joints, JointSample, SilenceWatch
from .joint_states import on_description, RobotJointStates

WATCH_PERIOD = 2.0  # [s] between two looks for joints without states


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
