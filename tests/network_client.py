# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""A ROS program of another host, which knows nothing of this workspace but its messages.

``call SERVICE SECONDS`` prints the nodes, and the answer of a Trigger service; ``jog`` jogs the
first joint, 50 times a second; ``watch`` prints "moving" and "still" as any joint of /joint_states
changes.
"""

from __future__ import annotations

import json
import sys

from control_msgs.msg import JointJog
import rclpy
from rclpy.node import Node
from rclpy.time import Time
from sensor_msgs.msg import JointState
from std_srvs.srv import Trigger

JOINT = 'panda_joint1'
WAY = 0.03  # [rad] three tenths of a second of the jog
REST = 1.0  # [s] without going so far


def call(node: Node, service: str, seconds: float) -> None:
    """Look for a service and call it; print the nodes seen and the answer."""
    client = node.create_client(Trigger, service)
    found = client.wait_for_service(seconds)
    answer = None
    if found:
        future = client.call_async(Trigger.Request())
        rclpy.spin_until_future_complete(node, future, timeout_sec=seconds)
        answer = future.done() and future.result().success
    nodes = sorted(set(node.get_node_names()) - {node.get_name()})
    sys.stdout.write(json.dumps({'nodes': nodes, 'answer': answer}) + '\n')


def jog(node: Node) -> None:
    """Turn the first joint one way, slowly: half a minute to its limit."""
    publisher = node.create_publisher(JointJog, 'servo_node/delta_joint_cmds', 10)

    def publish() -> None:
        message = JointJog(joint_names=[JOINT], velocities=[0.1])
        message.header.stamp = node.get_clock().now().to_msg()
        publisher.publish(message)

    node.create_timer(0.02, publish)
    rclpy.spin(node)


def watch(node: Node) -> None:
    """Print each change between motion and rest, with the time on the system clock [s].

    A single command that comes late makes no motion: an arm that is jogged goes on.
    """
    places: dict[str, float] = {}  # [rad] where the joints were when one of them last moved
    since, last = 0.0, ''  # [s]

    def take(message: JointState) -> None:
        nonlocal since, last
        now = Time.from_msg(message.header.stamp).nanoseconds * 1e-9
        positions = dict(zip(message.name, message.position, strict=True))
        moved = any(abs(positions[name] - place) > WAY for name, place in places.items())
        if moved or not places:
            places.update(positions)
            since = now
        state = 'moving' if moved else 'still' if now - since > REST else last
        if state != last:
            last = state
            sys.stdout.write(f'{state} {now:.3f}\n')
            sys.stdout.flush()

    node.create_subscription(JointState, 'joint_states', take, 10)
    rclpy.spin(node)


def main() -> None:
    """Do what the command line says."""
    rclpy.init(args=[])
    kind, *rest = sys.argv[1:]
    node = Node(f'desk_{kind}')
    if kind == 'call':
        call(node, rest[0], float(rest[1]))
    else:
        {'jog': jog, 'watch': watch}[kind](node)


if __name__ == '__main__':
    main()
