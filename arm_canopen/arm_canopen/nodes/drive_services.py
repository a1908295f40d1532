# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What a drive offers beside any device: services of ros2_canopen's 402 driver, joint states."""

from __future__ import annotations

from collections.abc import Sequence

from ..cia402.drive_commands import DriveCommands
from ..master.runner import NetworkThread
from .axis_services import AxisServices
from .device_node import DeviceNode
from .joint_states import DriveJointStates
from .units_service import BusFile, UnitsService


class DriveServices:
    """Services and topics of a drive with one axis or several."""

    def __init__(
        self,
        node: DeviceNode,
        axes: Sequence[DriveCommands],
        thread: NetworkThread,
        file: BusFile,
    ) -> None:
        self.axes = [commands.drive for commands in axes]  # its axes
        # their joint states
        self.joint_states = DriveJointStates(node, [axis.view for axis in self.axes])
        places = ['~' if len(axes) == 1 else axis.name for axis in self.axes]
        self._services = [
            AxisServices(node, commands, place, thread)
            for commands, place in zip(axes, places, strict=True)
        ]
        self._units = [
            UnitsService(node, axis, place, thread, file)
            for axis, place in zip(self.axes, places, strict=True)
        ]
