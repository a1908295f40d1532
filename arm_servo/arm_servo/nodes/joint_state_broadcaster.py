# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What joint_state_broadcaster publishes: /joint_states and /dynamic_joint_states."""

from __future__ import annotations

from control_msgs.msg import DynamicJointState, InterfaceValue
from rclpy.node import Node
from sensor_msgs.msg import JointState

from node_runner import ParameterReader

from ..gateway import CommandGateway
from .controller_manager import Controller
from .trajectory_parameters import RATES


def declare_broadcaster(node: Node) -> tuple[str, float, bool]:
    """Declare frame and rate [Hz] of the messages, and whether dynamic ones are published.

    Args:
        node: The node.
    """
    read = ParameterReader(node)
    return (
        read.text('frame_id', 'base_link', 'frame of the messages'),
        read.number('update_rate', 50.0, RATES, 'rate of the messages [Hz]'),
        read.flag(
            'publish_dynamic_joint_states', 'publish /dynamic_joint_states too', default=True
        ),
    )


class JointStateBroadcaster:
    """Publishes what the drives measure.

    Attributes:
        active: Whether it publishes.
        rate: Its rate in [Hz].
    """

    def __init__(self, node: Node, gateway: CommandGateway, *, active: bool) -> None:
        """Advertise.

        Args:
            node: The node ``joint_state_broadcaster``.
            gateway: Commands to the core.
            active: Whether it publishes from the start.
        """
        self.active = active
        self._node, self._gateway = node, gateway
        self._frame, self.rate, self._is_dynamic = declare_broadcaster(node)
        self._joints = list(gateway.model.joints)
        self._states = node.create_publisher(JointState, '/joint_states', 10)
        self._dynamic = node.create_publisher(DynamicJointState, '/dynamic_joint_states', 10)
        node.create_timer(1.0 / self.rate, self._publish)

    def entry(self) -> Controller:
        """Return it as the manager shows it."""
        kind = 'joint_state_broadcaster/JointStateBroadcaster'
        rate = round(self.rate)
        return Controller(self._node.get_name(), kind, rate, self.set_active, active=self.active)

    def set_active(self, active: bool) -> None:  # a callback of the manager
        """Publish, or stop publishing."""
        self.active = active

    def _publish(self) -> None:
        measured = self._gateway.snapshot.measured
        if measured is None or not self.active:
            return
        positions, velocities = measured.position.tolist(), measured.velocity.tolist()
        message = JointState(name=self._joints, position=positions, velocity=velocities)
        message.header.stamp = self._node.get_clock().now().to_msg()
        message.header.frame_id = self._frame
        self._states.publish(message)
        if self._is_dynamic:
            rows = zip(positions, velocities, strict=True)
            values = [
                InterfaceValue(interface_names=['position', 'velocity'], values=list(row))
                for row in rows
            ]
            dynamic = DynamicJointState(joint_names=self._joints, interface_values=values)
            dynamic.header = message.header
            self._dynamic.publish(dynamic)
