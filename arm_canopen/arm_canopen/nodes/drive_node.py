# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS node of a drive: the device node, and the services of ros2_canopen's 402 driver."""

from __future__ import annotations

from collections.abc import Sequence

from rclpy.publisher import Publisher
from rclpy.time import Time
from sensor_msgs.msg import JointState

from node_runner import destroyed_when_refused

from ..cia402.drive_commands import DriveCommands
from ..master.remote_node import RemoteNode
from ..master.runner import NetworkThread
from .axis_services import AxisServices
from .device_node import DeviceNode
from .output_thread import OutputThread


class DriveNode(DeviceNode):
    """Services and topics of a drive with one axis or several.

    Attributes:
        axes: Its axes.
        listened: Somebody listens to its joint states.
    """

    @destroyed_when_refused
    def __init__(
        self,
        device: RemoteNode,
        axes: Sequence[DriveCommands],
        thread: NetworkThread,
        output: OutputThread,
    ) -> None:
        """Offer the services.

        Args:
            device: The device.
            axes: Commands of its axes.
            thread: The thread of its network.
            output: The thread that publishes and answers.
        """
        super().__init__(device, thread, output)
        self.axes = [commands.drive for commands in axes]
        names = [axis.name for axis in self.axes]
        self._owned = device.config.commanded_indices
        self._joint_states = [(self._publisher('~'), _message(names), slice(None))]
        if len(names) > 1:  # and each channel as a drive of its own
            self._joint_states += [
                (self._publisher(name), _message([name]), slice(number, number + 1))
                for number, name in enumerate(names)
            ]
        self.listened = False
        self._axis_services = [
            AxisServices(self, commands, self._place(name), thread, output)
            for commands, name in zip(axes, names, strict=True)
        ]

    def update_listeners(self) -> None:
        """Look who listens, so that only what is heard is published."""
        super().update_listeners()
        self.listened = any(
            publisher.get_subscription_count() for publisher, _, _ in self._joint_states
        )

    def owns_object(self, index: int) -> bool:
        """Whether the drive writes an object itself in each cycle."""
        return index in self._owned

    def sample(self) -> list[tuple[float, float, float]] | None:
        """Return position, velocity and effort of each axis; None while one is not fresh."""
        if not all(axis.view.fresh for axis in self.axes):
            return None
        return [(axis.view.position, axis.view.velocity, axis.view.effort) for axis in self.axes]

    def publish_joint_state(self, stamp: Time, sample: list[tuple[float, float, float]]) -> None:
        """Publish the state of the joints at the time of a SYNC."""
        for publisher, message, axes in self._joint_states:
            message.header.stamp = stamp.to_msg()
            for number, (position, velocity, effort) in enumerate(sample[axes]):
                message.position[number] = position
                message.velocity[number] = velocity
                message.effort[number] = effort
            publisher.publish(message)

    def _publisher(self, name: str) -> Publisher:
        return self.create_publisher(JointState, f'{name}/joint_states', 10)

    def _place(self, axis: str) -> str:
        """Return what the names of an axis' services begin with."""
        return '~' if len(self.axes) == 1 else axis


def _message(joints: list[str]) -> JointState:
    zeros = [0.0] * len(joints)
    return JointState(name=joints, position=zeros, velocity=zeros, effort=zeros)
