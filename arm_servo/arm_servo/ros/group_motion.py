# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""One group of joints whose drives are on a bus: its core, and the nodes that command it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from rclpy.node import Node

from arm_model import ModelError, RobotModel
from arm_model.ros import same_robot

from ..core.gateway import CommandGateway, start_worker
from ..core.motion_core import MotionCore
from ..core.settings import CoreSettings
from ..io.drive_source import DriveSource
from .controller_manager import Controller, trajectory_entry
from .gripper.controller import GripperController
from .gripper.parameters import declare_gripper
from .servo.node import Servo
from .servo.parameters import declare_servo
from .trajectory.controller import TrajectoryController
from .trajectory.parameters import declare_trajectory

if TYPE_CHECKING:
    from arm_canopen import MasterProcess


class GroupDrives:
    """The drives of a group under a core of their own.

    Attributes:
        gateway: Commands to the core.
    """

    def __init__(self, master: MasterProcess, model: RobotModel, settings: CoreSettings) -> None:
        """Build the core; nothing moves yet.

        Args:
            master: The process that runs the bus.
            model: The group.
            settings: How the core behaves.

        Raises:
            ModelError: The core cannot move such a group.
        """
        self._master = master
        self.gateway = CommandGateway(MotionCore(model, settings), start_worker())
        self._source = DriveSource(self.gateway)

    @property
    def running(self) -> bool:
        """Whether the cycle asks for set-points."""
        return bool(self.gateway.snapshot.time)

    def prepare(self) -> None:
        """Get back the drives that were taken away, for the motion that follows."""
        if self._source.detached:
            self._source.attach(self._master.attach)


class ArmMotion:
    """An arm: a trajectory controller and a servo.

    Attributes:
        drives: Its drives.
        nodes: Its nodes.
    """

    def __init__(
        self, master: MasterProcess, model: RobotModel, controller: Node, servo: Node
    ) -> None:
        """Offer both.

        Args:
            master: The process that runs the bus.
            model: The arm.
            controller: Node of the trajectory controller.
            servo: Node of the servo.

        Raises:
            ParameterError: A parameter is misspelt, of another kind or out of its range.
            ModelError: The parameters do not fit the arm.
        """
        same_robot(servo, model)
        trajectory = declare_trajectory(controller, model.joints)
        jogging = declare_servo(servo, model)
        settings = CoreSettings(
            jogging.settings,
            trajectory.execution,
            jogging.timeout,
            jogging.clearance,
            check_self_collision=trajectory.check,
        )
        self.nodes: Sequence[Node] = (controller, servo)
        self.drives = drives = GroupDrives(master, model, settings)
        self._servo = Servo(servo, drives.gateway, jogging, drives.prepare)
        self._controller = TrajectoryController(
            controller, drives.gateway, trajectory, drives.prepare
        )

    def entry(self, period: float) -> Controller:
        """Return the trajectory controller as the manager shows it.

        Args:
            period: Period of the cycle in [s].
        """
        return _entry(self.nodes[0], self.drives, period, self._controller)


class ToolMotion:
    """An end effector: a gripper and a trajectory controller on one node.

    Its links may touch: a gripper holds something.

    Attributes:
        drives: Its drives.
        nodes: Its node.
    """

    def __init__(self, master: MasterProcess, model: RobotModel, controller: Node) -> None:
        """Offer both.

        Args:
            master: The process that runs the bus.
            model: The end effector.
            controller: The node.

        Raises:
            ParameterError: A parameter is misspelt, of another kind or out of its range.
            ModelError: The core cannot move it.
        """
        trajectory = declare_trajectory(controller, model.joints)
        gripper = declare_gripper(controller)
        settings = CoreSettings(
            execution=trajectory.execution, clearance=None, check_self_collision=False
        )
        self.nodes: Sequence[Node] = (controller,)
        self.drives = drives = GroupDrives(master, model, settings)
        self._controller = TrajectoryController(
            controller, drives.gateway, trajectory, drives.prepare
        )
        self._gripper = GripperController(controller, drives.gateway, gripper, drives.prepare)

    def entry(self, period: float) -> Controller:
        """Return the controller as the manager shows it.

        Args:
            period: Period of the cycle in [s].
        """
        return _entry(self.nodes[0], self.drives, period, self._controller)


def _entry(
    node: Node, drives: GroupDrives, period: float, controller: TrajectoryController
) -> Controller:
    joints = drives.gateway.model.joints
    return trajectory_entry(node.get_name(), joints, period, controller.set_active)


def check_drives(master: MasterProcess, model: RobotModel) -> None:
    """Make sure that each joint of a group has a drive.

    Args:
        master: The process that runs the bus.
        model: The group.

    Raises:
        ModelError: One has none.
    """
    drives = master.bus.joints
    if missing := [name for name in model.joints if name not in drives]:
        raise ModelError(
            f'{master.bus.file} has no drive {missing[0]!r}; drives have the names of the'
            f' joints, and there are: {", ".join(drives) or "none"}'
        )
