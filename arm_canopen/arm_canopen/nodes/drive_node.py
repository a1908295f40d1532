# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The ROS node of one drive: the device node, and the services of ros2_canopen's 402 driver."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from concurrent.futures import Future
from typing import Any

from canopen_interfaces.srv import COTargetDouble
from rclpy.time import Time
from sensor_msgs.msg import JointState

from ..cia402.drive import Drive
from ..cia402.drive_commands import DriveCommands
from ..master.runner import NetworkThread
from ..master.scheduler import Promise
from ..standard.drive import OperationMode
from ..standard.objects import Index
from .device_node import DeviceNode
from .output_thread import OutputThread

MODE_SERVICES: dict[str, OperationMode] = {
    'position_mode': OperationMode.PROFILE_POSITION,
    'velocity_mode': OperationMode.PROFILE_VELOCITY,
    'torque_mode': OperationMode.PROFILE_TORQUE,
    'interpolated_position_mode': OperationMode.INTERPOLATED_POSITION,
    'cyclic_position_mode': OperationMode.CYCLIC_POSITION,
    'cyclic_velocity_mode': OperationMode.CYCLIC_VELOCITY,
    'cyclic_torque_mode': OperationMode.CYCLIC_TORQUE,
}
"""Services of ros2_canopen and the modes that they select."""

OWNED_OBJECTS = frozenset(
    {
        Index.CONTROLWORD,
        Index.MODE_OF_OPERATION,
        Index.TARGET_POSITION,
        Index.TARGET_VELOCITY,
        Index.INTERPOLATION_DATA,
    }
)
"""Objects that the drive writes itself in each cycle."""

Sequence = Callable[[], Coroutine[Promise[Any], None, str]]


class DriveNode(DeviceNode):
    """Services and topics of one drive."""

    def __init__(
        self,
        drive: Drive,
        commands: DriveCommands,
        thread: NetworkThread,
        output: OutputThread,
    ) -> None:
        """Offer the services.

        Args:
            drive: The drive.
            commands: Its commands.
            thread: The thread of its network.
            output: The thread that publishes and answers.
        """
        super().__init__(drive.node, thread, output)
        self.drive = drive
        self._commands = commands
        self._joint_states = self.create_publisher(JointState, '~/joint_states', 10)
        self._message = JointState(name=[drive.name], position=[0.0], velocity=[0.0], effort=[0.0])
        self.listened = False
        self._offer('init', commands.init)
        self._offer('enable', commands.enable)
        self._offer('recover', commands.recover)
        self._offer('disable', commands.disable, preempt=True)
        self._offer('halt', commands.halt, preempt=True)
        for name, mode in MODE_SERVICES.items():
            self._offer_mode(name, mode)
        self.offer(COTargetDouble, 'target', self._set_target, self._answer_target)

    def update_listeners(self) -> None:
        """Look who listens, so that only what is heard is published."""
        super().update_listeners()
        self.listened = self._joint_states.get_subscription_count() > 0

    def owns_object(self, index: int) -> bool:
        """Whether the drive writes an object itself in each cycle."""
        return index in OWNED_OBJECTS

    def publish_joint_state(
        self, stamp: Time, position: float, velocity: float, effort: float
    ) -> None:
        """Publish the state of the joint at the time of a SYNC."""
        message = self._message
        message.header.stamp = stamp.to_msg()
        message.position[0] = position
        message.velocity[0] = velocity
        message.effort[0] = effort
        self._joint_states.publish(message)

    def _offer(self, name: str, sequence: Sequence, *, preempt: bool = False) -> None:
        def run() -> Promise[str]:
            self.admit()  # again, in the thread in which the node may have been deactivated
            return self._commands.run(name, sequence(), preempt=preempt)

        self.offer_trigger(name, lambda: self._thread.run(run))

    def _offer_mode(self, name: str, mode: OperationMode) -> None:
        self._offer(name, lambda: self._commands.select_mode(mode))

    def _set_target(self, request: COTargetDouble.Request) -> Future[str]:
        def set_target() -> str:
            self.admit()
            return self._commands.set_target(request.target)

        return self._thread.call(set_target)

    def _answer_target(self, response: COTargetDouble.Response, future: Future[str]) -> None:
        error = future.exception()
        response.success = error is None
        if error is not None:
            self.get_logger().warning(f'target: {error}')
