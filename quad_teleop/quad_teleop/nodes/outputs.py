# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the teleop nodes publish."""

from __future__ import annotations

from geometry_msgs.msg import Point, Pose, Quaternion, Twist, TwistStamped, Vector3
from rclpy.duration import Duration
from rclpy.node import Node
from rclpy.publisher import Publisher

from node_runner import ParameterReader

from ..body_pose import BodyPose
from ..exceptions import SettingError
from ..velocity import Velocity

FLUSH_TIMEOUT = Duration(nanoseconds=300_000_000)


class Outputs:
    """Velocities as Twist, TwistStamped or both; poses of the body.

    Attributes:
        topics: The full names of the velocity topics.
    """

    def __init__(self, node: Node) -> None:
        """Declare the parameters and advertise the topics.

        Args:
            node: The node.

        Raises:
            ParameterError: A value is of another kind.
            SettingError: Neither kind of message is wanted.
        """
        read = ParameterReader(node)
        twist = read.flag('twist', 'publish cmd_vel (Twist)', default=True)
        stamped = read.flag('stamped', 'publish cmd_vel_stamped (TwistStamped)', default=False)
        if not (twist or stamped):
            raise SettingError('twist and stamped are both false: nothing would be published')
        self._node = node
        self._frame = read.text('frame_id', 'base_link', 'frame of TwistStamped')
        self._pose = node.create_publisher(Pose, 'body_pose', 1)
        self._twist = node.create_publisher(Twist, 'cmd_vel', 1) if twist else None
        self._stamped = (
            node.create_publisher(TwistStamped, 'cmd_vel_stamped', 1) if stamped else None
        )
        self.topics = [publisher.topic_name for publisher in self._publishers()]

    @property
    def has_subscriber(self) -> bool:
        """Whether anybody listens to the velocities."""
        return any(publisher.get_subscription_count() for publisher in self._publishers())

    def publish(self, velocity: Velocity) -> None:
        """Publish a velocity.

        Args:
            velocity: In base_link.
        """
        twist = Twist(
            linear=Vector3(x=velocity.x, y=velocity.y, z=0.0),
            angular=Vector3(x=0.0, y=0.0, z=velocity.yaw),
        )
        if self._twist is not None:
            self._twist.publish(twist)
        if self._stamped is not None:
            message = TwistStamped(twist=twist)
            message.header.frame_id = self._frame
            message.header.stamp = self._node.get_clock().now().to_msg()
            self._stamped.publish(message)

    def publish_pose(self, pose: BodyPose) -> None:
        """Publish a pose of the body.

        Args:
            pose: Offset from how the robot stands by itself.
        """
        x, y, z, w = pose.quaternion()
        self._pose.publish(
            Pose(
                position=Point(x=0.0, y=0.0, z=pose.height),
                orientation=Quaternion(x=x, y=y, z=z, w=w),
            )
        )

    def flush(self) -> None:
        """Wait until what was published has arrived, before the program ends."""
        for publisher in self._publishers():
            publisher.wait_for_all_acked(FLUSH_TIMEOUT)

    def _publishers(self) -> list[Publisher]:
        return [each for each in (self._twist, self._stamped) if each is not None]
