# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Back end for drives on a CAN bus: runs motion cores in the cycle of arm_canopen's master."""

from __future__ import annotations

from contextlib import ExitStack
import threading
from typing import TYPE_CHECKING

from rclpy.node import Node
from urdf_reader import read_urdf

from arm_canopen import CanopenError, serve_buses
from arm_model import ModelError, RobotModel
from arm_model.ros import declare_groups
from node_runner import destroyed_if_refused

from ..controllers.controller import BackendError
from ..core.gateway import CommandGateway, start_worker
from ..core.motion_core import MotionCore
from ..core.preparation import CoreSettings
from ..drive_source import DriveSource
from .controller_manager import ControllerManager, declare_manager, JointStateBroadcaster
from .group_motion import (
    build_groups,
    by_check,
    check_names,
    MakeNode,
    Offers,
    watch_other_programs,
)
from .scene_listener import SceneListener

if TYPE_CHECKING:
    from arm_canopen import MasterProcess

ATTACH_PERIOD = 0.2  # time between two tries to attach when the bus starts in [s]


def serve_canopen(stop: threading.Event, offers: Offers) -> None:
    """Run the master with motion cores until stopped, then disable the drives.

    Raises:
        BackendError: The bus cannot be configured or opened, or already has a master.
    """
    try:
        serve_buses(stop, lambda master: CanopenMotion(master, offers).nodes)
    except CanopenError as error:
        raise BackendError(str(error)) from error


class CanopenMotion:
    """Nodes and motion cores of a robot whose drives are on one bus."""

    def __init__(self, master: MasterProcess, offers: Offers) -> None:
        """Build cores and nodes, without moving.

        Raises:
            ParameterError: A parameter is misspelt, of the wrong type or out of range.
            ModelError: The parameters do not define an arm, or a joint has no drive.
        """
        self._master = master
        with ExitStack() as stack:
            self._build(lambda name: stack.enter_context(destroyed_if_refused(Node(name))), offers)
        watch_other_programs(self.nodes)
        self._attaching = self._manager.create_timer(ATTACH_PERIOD, self._attach_first)

    def _build(self, make_node: MakeNode, offers: Offers) -> None:
        self._manager = manager = make_node('controller_manager')
        models = declare_groups(manager)
        main = models.arms[0]
        name, broadcasts = declare_manager(manager, main)

        groups = build_groups(models, name, make_node, offers, self._drive)
        self._gateways = [group.gateway for group in groups]
        SceneListener(manager, *by_check(groups))
        broadcaster = make_node('joint_state_broadcaster')
        followers = read_urdf(manager.get_parameter('robot_description').value).movable()
        self._broadcaster = JointStateBroadcaster(
            broadcaster,
            self._gateways[0],
            [name for name in self._master.bus.joints if name not in main.joints],
            {each.name: each.mimic for each in followers if each.mimic is not None},
            active=broadcasts,
        )
        self.nodes = [manager, *(node for each in groups for node in each.nodes), broadcaster]
        period = self._master.bus.master.sync_period
        entries = [entry for group in groups for entry in group.entries(period)]
        self._switch = ControllerManager(manager, [*entries, self._broadcaster.entry()])
        check_names(self.nodes)
        for note in models.notes:
            manager.get_logger().warning(note)

    def _drive(self, _: Node, model: RobotModel, settings: CoreSettings) -> CommandGateway:
        """Build the core of a group for its drives, without moving.

        Raises:
            ModelError: A joint has no drive, or the core cannot move such a group.
        """
        bus = self._master.bus
        if missing := [name for name in model.joints if name not in bus.joints]:
            raise ModelError(
                f'{bus.file} has no drive {missing[0]!r}; drives have the names of the'
                f' joints, and there are: {", ".join(bus.joints) or "none"}'
            )
        gateway = CommandGateway(MotionCore(model, settings), start_worker())
        DriveSource(gateway, self._master.attach)
        return gateway

    def _attach_first(self) -> None:
        waiting = [gateway for gateway in self._gateways if not gateway.snapshot.time]
        for gateway in waiting:
            gateway.get_ready()
        if not waiting:  # the cycle asks for set-points
            self._manager.destroy_timer(self._attaching)
