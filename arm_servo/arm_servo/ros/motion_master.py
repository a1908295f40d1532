# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_servo motion_master``: the master of arm_canopen with the motion core inside.

It takes what ``ros2 run arm_canopen master`` takes, and what describes the arm.
"""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
import sys
from typing import TYPE_CHECKING

from rclpy.node import Node
from urdf_reader import Mimic, read_urdf

from arm_canopen import run_master
from arm_model import ArmError
from arm_model.ros import declare_groups
from node_runner import destroyed_if_refused

from .controller_manager import ControllerManager, declare_manager
from .group_motion import ArmMotion, check_drives, ToolMotion
from .joint_state_broadcaster import JointStateBroadcaster
from .upstream_parameters import check_names

if TYPE_CHECKING:
    from arm_canopen import MasterProcess

ATTACH_PERIOD = 0.2
"""Time between two tries to attach when the bus starts in [s]."""


class Motion:
    """The nodes of a robot whose drives are on one bus.

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
        models = declare_groups(manager)
        main, *others = models.arms
        name, broadcasts = declare_manager(manager, main)
        for model in (*models.arms, *models.tools):
            check_drives(self._master, model)
        self._groups: list[ArmMotion | ToolMotion] = [
            ArmMotion(self._master, main, make_node(name), make_node('servo_node'))
        ]
        for model in others:
            controller = make_node(f'{model.group}_controller')
            servo = make_node(f'{model.group}_servo_node')
            self._groups.append(ArmMotion(self._master, model, controller, servo))
        for model in models.tools:
            controller = make_node(f'{model.group}_controller')
            self._groups.append(ToolMotion(self._master, model, controller))
        broadcaster = make_node('joint_state_broadcaster')
        self._broadcaster = JointStateBroadcaster(
            broadcaster,
            self._groups[0].drives.gateway,
            [name for name in self._master.bus.joints if name not in main.joints],
            _mimics(manager),
            active=broadcasts,
        )
        self.nodes = [
            manager,
            *(node for group in self._groups for node in group.nodes),
            broadcaster,
        ]
        period = self._master.bus.master.sync_period
        entries = [group.entry(period) for group in self._groups]
        self._switch = ControllerManager(manager, [*entries, self._broadcaster.entry()])
        for node in self.nodes:
            check_names(node)
        notes = (note for model in (*models.arms, *models.tools) for note in model.notes)
        for note in dict.fromkeys(notes):
            manager.get_logger().warning(note)
        self._attaching = manager.create_timer(ATTACH_PERIOD, self._attach_first)

    def _attach_first(self) -> None:
        waiting = [group.drives for group in self._groups if not group.drives.running]
        for drives in waiting:
            drives.prepare()
        if not waiting:  # the cycle asks for set-points
            self._manager.destroy_timer(self._attaching)


def _mimics(node: Node) -> dict[str, Mimic]:
    """Return the joints of the description that follow others."""
    tree = read_urdf(node.get_parameter('robot_description').value)
    return {joint.name: joint.mimic for joint in tree.movable() if joint.mimic is not None}


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
