# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Nodes for the command-line tests to look at, all in one process; prints `ready` when up."""

from __future__ import annotations

import contextlib
import sys
from typing import Any

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
import rclpy
from rclpy.executors import ExternalShutdownException, SingleThreadedExecutor
from rclpy.lifecycle import LifecycleNode
from rclpy.node import Node
from rclpy.qos import QoSDurabilityPolicy, QoSProfile, QoSReliabilityPolicy
from sensor_msgs.msg import JointState
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

LATCHED = QoSProfile(  # type: ignore[no-untyped-call]
    depth=1, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL
)
KEPT = QoSProfile(  # type: ignore[no-untyped-call]
    depth=10, durability=QoSDurabilityPolicy.TRANSIENT_LOCAL
)
BEST_EFFORT = QoSProfile(  # type: ignore[no-untyped-call]
    depth=1, reliability=QoSReliabilityPolicy.BEST_EFFORT
)


class Talker(Node):
    """Publishes on topics of several kinds and offers services."""

    def __init__(self) -> None:
        super().__init__('talker')
        self._count = 0
        self._received = ''
        self._chatter = self.create_publisher(String, 'chatter', 10)
        self._hidden = self.create_publisher(String, '_hidden_chatter', 10)
        self._joints = self.create_publisher(JointState, 'joint_states', 10)
        self._mixed = [self.create_publisher(String, 'mixed', qos) for qos in (10, BEST_EFFORT)]
        self._latched = self.create_publisher(String, 'latched', LATCHED)
        self._latched.publish(String(data='kept'))
        self.create_timer(0.02, self._publish)
        # keeps what comes while it is being connected, so that the tests need no luck
        self.create_subscription(String, 'listener/input', self._receive, KEPT)
        self.create_subscription(JointState, 'listener/stamped', self._receive_stamped, KEPT)
        self.create_service(Trigger, 'trigger', self._trigger)
        self.create_service(Trigger, 'last_received', self._answer_received)
        self.create_service(SetBool, 'set_bool', self._set_bool)
        self.create_service(Trigger, '_hidden_service', self._trigger)

    def _publish(self) -> None:
        self._count += 1
        for publisher in (self._chatter, self._hidden, *self._mixed):
            publisher.publish(String(data=f'Hello World: {self._count}'))
        joints = JointState(name=['one', 'two'], position=[0.5, -1.0])
        joints.header.stamp = self.get_clock().now().to_msg()
        joints.header.frame_id = 'base'
        self._joints.publish(joints)

    def _receive(self, message: String) -> None:
        self._received += message.data + ';'

    def _receive_stamped(self, message: JointState) -> None:
        self._received += f'stamp {message.header.stamp.sec};'

    def _trigger(self, _: Any, response: Any) -> Any:
        response.success, response.message = True, 'done'
        return response

    def _answer_received(self, _: Any, response: Any) -> Any:
        response.success, response.message = True, self._received
        return response

    def _set_bool(self, request: Any, response: Any) -> Any:
        response.success, response.message = request.data, f'data is {request.data}'
        return response


def make_worker() -> Node:
    """Make a node with parameters."""
    worker = Node('worker', namespace='/factory')
    gain = ParameterDescriptor(
        description='Gain of the loop',
        additional_constraints='even',
        floating_point_range=[FloatingPointRange(from_value=0.0, to_value=10.0, step=0.5)],
    )
    worker.declare_parameter('gain', 1.5, gain)
    worker.declare_parameter('label', 'first')
    worker.declare_parameter('limits.upper', [1, 2, 3])
    worker.declare_parameter('fixed', True, ParameterDescriptor(read_only=True))
    worker.declare_parameter('loose', 'x', ParameterDescriptor(dynamic_typing=True))
    return worker


def main() -> None:
    """Serve all nodes until the process is ended."""
    rclpy.init(args=sys.argv)
    executor = SingleThreadedExecutor()
    for node in (Talker(), make_worker(), Node('_hidden'), LifecycleNode('machine')):
        executor.add_node(node)
    print('ready', flush=True)
    with contextlib.suppress(KeyboardInterrupt, ExternalShutdownException):
        executor.spin()


if __name__ == '__main__':
    main()
