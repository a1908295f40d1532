# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The other end of the programs for jogging: receives commands, and answers as a servo node."""

from __future__ import annotations

from typing import Any

from control_msgs.msg import JointJog
from geometry_msgs.msg import TwistStamped
from moveit_msgs.msg import ServoStatus
from moveit_msgs.srv import ServoCommandType
from ros_client import RosClient
from std_srvs.srv import SetBool

TIMEOUT = 30.0  # [s] of a test on a busy machine

Twist = tuple[str, tuple[float, ...]]


class ServoListener:
    """Listens like a servo node, in a domain of its own.

    Attributes:
        client: The node behind it, whose name is servo_node.
        twists: Commands for the tool.
        jogs: Commands for joints.
        types: What the command type was switched to.
        pauses: What pause_servo was asked for.
    """

    def __init__(self, client: RosClient, urdf: str, srdf: str) -> None:
        self.client = client
        node = client.node
        node.declare_parameter('robot_description', urdf)
        node.declare_parameter('robot_description_semantic', srdf)
        node.declare_parameter('moveit_servo.command_in_type', 'speed_units')
        node.declare_parameter('moveit_servo.scale.linear', 0.2)
        self.twists: list[TwistStamped] = []
        self.jogs: list[JointJog] = []
        self.types: list[int] = []
        self.pauses: list[bool] = []
        node.create_subscription(TwistStamped, '~/delta_twist_cmds', self.twists.append, 10)
        node.create_subscription(JointJog, '~/delta_joint_cmds', self.jogs.append, 10)
        node.create_service(ServoCommandType, '~/switch_command_type', self._switch)
        node.create_service(SetBool, '~/pause_servo', self._pause)
        self._status = node.create_publisher(ServoStatus, '~/status', 10)

    def say(self, code: int, message: str) -> None:
        """Publish a status."""
        self._status.publish(ServoStatus(code=code, message=message))

    @property
    def received(self) -> list[Twist]:
        """Frame and numbers of each twist."""
        return [(each.header.frame_id, _numbers(each)) for each in self.twists]

    def _switch(self, request: Any, response: Any) -> Any:
        self.types.append(request.command_type)
        response.success = True
        return response

    def _pause(self, request: Any, response: Any) -> Any:
        self.pauses.append(request.data)
        response.success, response.message = True, 'done'
        return response


def _numbers(message: TwistStamped) -> tuple[float, ...]:
    linear, angular = message.twist.linear, message.twist.angular
    values = (linear.x, linear.y, linear.z, angular.x, angular.y, angular.z)
    return tuple(round(value, 6) for value in values)
