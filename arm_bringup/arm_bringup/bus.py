# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The CANopen bus of a robot folder: its bus.yml, and what follows from it for all nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from process_supervisor import RosOptions

from .exceptions import RobotError
from .robots import Robot

if TYPE_CHECKING:
    from arm_canopen import BusConfig, NodeConfig

INTERPOLATED_POSITION = 7  # mode of operation (CiA 402-2, 0x6060)


def read_bus(robot: Robot) -> BusConfig:
    """Read the bus.yml of a robot, and so find its mistakes before anything is started.

    Returns:
        Its bus, with one drive at least.

    Raises:
        RobotError: The file, or an EDS that it names, is wrong; the message says where and what.
    """
    from arm_canopen import CanopenError, load_bus

    try:
        bus = load_bus(robot.bus_config)
    except CanopenError as error:
        raise RobotError(str(error)) from error
    if not bus.joints:
        raise RobotError(f'{robot.bus_config} has no drive (a node with a Cia402 driver)')
    return bus


def in_namespace_of_bus(ros: RosOptions, bus: BusConfig) -> RosOptions:
    """Use the namespace of bus.yml for all nodes, unless the command line has one.

    Raises:
        RobotError: Its nodes are in several.
    """
    named = [bus.master.namespace, *(node.namespace for node in bus.nodes)]
    given = {namespace.strip('/') for namespace in named} - {''}
    if len(given) > 1 and not ros.namespace:
        raise RobotError(
            f'bus.yml puts its nodes into several namespaces ({", ".join(sorted(given))}); '
            'choose one for all with --namespace'
        )
    return ros.within(next(iter(given), ''))


def stream_mode_service(bus: BusConfig) -> str:
    """Name the service for the mode of streams: what bus.yml asks for, else cyclic position."""
    drives: list[NodeConfig] = [node for node in bus.nodes if node.is_drive]
    if all(drive.drive.position_mode == INTERPOLATED_POSITION for drive in drives):
        return 'interpolated_position_mode'
    return 'cyclic_position_mode'
