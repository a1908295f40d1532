# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo motion_master``: the master of arm_canopen with the motion core inside.

It takes what ``ros2 run arm_canopen master`` takes, and what describes the arm.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
import sys
from typing import TYPE_CHECKING

from rclpy.node import Node

from arm_canopen import run_master
from arm_model import ArmError, ModelError
from arm_model.ros import declare_robot, same_robot
from node_runner import destroyed_if_refused

from ..core.gateway import CommandGateway, start_worker
from ..core.motion_core import MotionCore
from ..core.settings import CoreSettings
from ..io.drive_source import DriveSource
from .controller_manager import ControllerManager, declare_manager, trajectory_entry
from .joint_state_broadcaster import JointStateBroadcaster
from .servo.node import Servo
from .servo.parameters import declare_servo
from .trajectory.controller import TrajectoryController
from .trajectory.parameters import declare_trajectory
from .upstream_parameters import check_names

if TYPE_CHECKING:
    from arm_canopen import MasterProcess

ATTACH_PERIOD = 0.2
"""Time between two tries to attach when the bus starts in [s]."""


class Motion:
    """The nodes of an arm whose drives are on one bus.

    Attributes:
        nodes: The nodes, for the executor of the master.
    """

    def __init__(self, master: MasterProcess) -> None:
        """Build core and nodes; nothing moves yet.

        Args:
            master: The process that runs the bus.

        Raises:
            ParameterError: A parameter is misspelt, of another kind or out of its range.
            ModelError: The parameters do not make an arm, or it has joints without a drive.
        """
        self._master = master
        with ExitStack() as stack:
            self._build(lambda name: stack.enter_context(destroyed_if_refused(Node(name))))

    def _build(self, make_node: Callable[[str], Node]) -> None:
        self._manager = manager = make_node('controller_manager')
        model = declare_robot(manager)
        name, broadcasts = declare_manager(manager, model)
        self._check_drives(self._master, model.joints)
        controller, servo = make_node(name), make_node('servo_node')
        broadcaster = make_node('joint_state_broadcaster')
        self.nodes = [manager, controller, servo, broadcaster]
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
        self._gateway = CommandGateway(MotionCore(model, settings), start_worker())
        self._source = DriveSource(self._gateway)
        self._servo = Servo(servo, self._gateway, jogging, self._prepare)
        self._controller = TrajectoryController(
            controller, self._gateway, trajectory, self._prepare
        )
        self._broadcaster = JointStateBroadcaster(
            broadcaster,
            self._gateway,
            [name for name in self._master.bus.joints if name not in model.joints],
            active=broadcasts,
        )
        period = self._master.bus.master.sync_period
        self._switch = ControllerManager(
            manager,
            [
                trajectory_entry(name, model.joints, period, self._controller.set_active),
                self._broadcaster.entry(),
            ],
        )
        for node in self.nodes:
            check_names(node)
        for note in model.notes:
            manager.get_logger().warning(note)
        self._attaching = manager.create_timer(ATTACH_PERIOD, self._attach_first)

    def _check_drives(self, master: MasterProcess, joints: Sequence[str]) -> None:
        drives = master.bus.joints
        missing = [name for name in joints if name not in drives]
        if missing:
            raise ModelError(
                f'{master.bus.file} has no drive {missing[0]!r}; drives have the names of the'
                f' joints, and there are: {", ".join(drives) or "none"}'
            )

    def _attach_first(self) -> None:
        self._prepare()
        if self._gateway.snapshot.time:  # the cycle asks for set-points
            self._manager.destroy_timer(self._attaching)

    def _prepare(self) -> None:
        """Get back the drives that were taken away, for the motion that follows."""
        if self._source.detached:
            self._source.attach(self._master.attach)


def main(argv: list[str] | None = None) -> int:
    """Run the master with the motion core until Ctrl-C.

    Args:
        argv: ROS arguments; None takes those of the process.

    Returns:
        The exit code of the master, 1 when the arm cannot be built.
    """
    return run_master(argv, extend=lambda master: Motion(master).nodes, errors=[ArmError])


if __name__ == '__main__':
    sys.exit(main())
