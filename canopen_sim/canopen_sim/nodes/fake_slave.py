# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run canopen_sim fake_slave``: one simulated device, made from an EDS."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
import sys

from ament_index_python.packages import get_package_share_directory
from rclpy.node import Node

from canopen_core.eds import load_eds
from canopen_core.standard import NODE_ID_MAX, NODE_ID_MIN
from node_runner import ParameterReader

from ..host import DeviceHost
from .fake_slaves import memories, run_slaves

DEFAULT_NODE_ID = 2
HELP = f"""\
Simulate one CANopen device, made from an EDS, until Ctrl-C.

usage: ros2 run canopen_sim fake_slave [--ros-args -p NAME:=VALUE ...]

example:
  ros2 run canopen_sim fake_slave --ros-args -p node_id:=3 -p slave_config:=drive.eds

parameters:
  node_id             CANopen node id, 1 to 127 (default {DEFAULT_NODE_ID})
  slave_config        EDS of the device (default: the drive of arm_canopen/eds/cia402_drive.eds)
"""


def main() -> None:
    """Entry point."""
    sys.exit(run_slaves('fake_slave', _populate, help_text=HELP))


def default_eds() -> Path:
    """Return the EDS of the simulated drive, as installed with this package."""
    return Path(get_package_share_directory('arm_canopen')) / 'eds' / 'cia402_drive.eds'


def _populate(node: Node, host: DeviceHost) -> tuple[str, Mapping[str, int]]:
    read = ParameterReader(node)
    node_id = read.whole(
        'node_id',
        DEFAULT_NODE_ID,
        (NODE_ID_MIN, NODE_ID_MAX),
        'CANopen node id of the device',
    )
    path = read.text('slave_config', '', 'EDS of the device; empty for our own drive')
    eds = load_eds(path or default_eds())
    for warning in eds.warnings:
        node.get_logger().warning(str(warning))
    device = host.add(node_id, eds.dictionary, memory=memories(node)(node_id))
    kind = 'drive' if device.drive is not None else 'device'
    return f'simulated {kind} {node_id} of {eds.path}', {'slave': node_id}


if __name__ == '__main__':
    main()
