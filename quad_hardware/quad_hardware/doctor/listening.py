# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Listens to the topics of the robot for a while."""

from __future__ import annotations

from collections.abc import Callable
import time

from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from nav_msgs.msg import Odometry
import rclpy
from rclpy.context import Context
from rclpy.executors import SingleThreadedExecutor
from rclpy.node import Node
from rclpy.qos import DurabilityPolicy, qos_profile_sensor_data, QoSProfile
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import String
from tf2_msgs.msg import TFMessage

from node_runner import init_ros
from quad_msgs.msg import JointCommand

from .graph_checks import NODES, Observation

SETTLING = 1.0  # [s] until topics are connected
DISCOVERY = 5.0  # [s] until the others are found, if they are there at all
_KINDS = {
    'joint_states': JointState,
    'imu': Imu,
    'odom': Odometry,
    'joint_command': JointCommand,
}
_LATCHED = QoSProfile(depth=100, durability=DurabilityPolicy.TRANSIENT_LOCAL)


def observe(duration: float) -> Observation:
    """Listen; rclpy need not be initialised."""
    context = Context()
    init_ros(context=context)
    node = Node('quad_doctor', context=context, enable_rosout=False)
    executor = SingleThreadedExecutor(context=context)
    executor.add_node(node)
    try:
        seen = Observation(duration)
        _subscribe(node, seen)
        deadline = time.monotonic() + DISCOVERY
        while not set(NODES) & set(node.get_node_names()) and time.monotonic() < deadline:
            _spin(executor, DISCOVERY / 50)
        _spin(executor, SETTLING)
        seen.counts.clear()
        began = time.monotonic()
        _spin(executor, duration)
        seen.duration = time.monotonic() - began
        seen.nodes = set(node.get_node_names())
        for topic in _KINDS:
            infos = node.get_publishers_info_by_topic(topic)
            seen.publishers[topic] = [info.node_name for info in infos]
        return seen
    finally:
        executor.shutdown()
        node.destroy_node()
        rclpy.shutdown(context=context)


def _spin(executor: SingleThreadedExecutor, duration: float) -> None:
    end = time.monotonic() + duration
    while (left := end - time.monotonic()) > 0:
        executor.spin_once(left)


def _subscribe(node: Node, seen: Observation) -> None:
    for topic, kind in _KINDS.items():
        node.create_subscription(kind, topic, _count(seen, topic), qos_profile_sensor_data)

    def description(message: String) -> None:
        seen.urdf = message.data

    def transforms(message: TFMessage) -> None:
        seen.parents.update({t.child_frame_id: t.header.frame_id for t in message.transforms})

    def diagnostics(message: DiagnosticArray) -> None:
        names = {status.name for status in message.status}
        kept = [entry for entry in seen.diagnostics if entry[1].split(' (')[0] not in names]
        bad = (s for s in message.status if s.level != DiagnosticStatus.OK)
        seen.diagnostics = [*kept, *((s.level[0], f'{s.name} ({s.message})') for s in bad)]

    node.create_subscription(String, 'robot_description', description, _LATCHED)
    node.create_subscription(TFMessage, '/tf', transforms, 100)
    node.create_subscription(TFMessage, '/tf_static', transforms, _LATCHED)
    node.create_subscription(DiagnosticArray, 'diagnostics', diagnostics, 10)


def _count(seen: Observation, topic: str) -> Callable[[object], None]:
    def take(message: object) -> None:
        seen.counts[topic] = seen.counts.get(topic, 0) + 1
        if isinstance(message, JointState):
            seen.joints = tuple(message.name)

    return take
