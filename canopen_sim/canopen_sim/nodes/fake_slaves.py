# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run canopen_sim fake_slaves``: simulated devices for all slaves of a bus.yml."""

from __future__ import annotations

from collections.abc import Sequence
import sys

from rclpy.node import Node

from arm_canopen import CanopenError
from arm_canopen.config import BusConfig, load_bus
from node_runner import ParameterReader

from ..host import DeviceHost
from ..simulation import add_devices
from .slave_process import memories, run_slaves, SimulatedDevices

HELP = """\
Simulate every device of a bus.yml, each made from its EDS, until Ctrl-C.

usage: ros2 run canopen_sim fake_slaves --ros-args -p bus_config:=FILE [-p NAME:=VALUE ...]

example:
  ros2 run canopen_sim fake_slaves --ros-args -p bus_config:=bus.yml

parameters:
  bus_config          bus.yml whose devices are simulated (required)
  positions.<drive>   where a drive stands at the start in the units of bus.yml [rad or m], as an
                      absolute encoder reports it (default: 0 increments)
"""


def run_fake_slaves(args: Sequence[str] | None = None) -> int:
    """Simulate every device of a bus.yml in this process; return the exit code."""
    return run_slaves('fake_slaves', _populate, help_text=HELP, args=args)


def main() -> None:
    """Entry point."""
    sys.exit(run_fake_slaves())


def _populate(node: Node, host: DeviceHost) -> SimulatedDevices:
    path = ParameterReader(node).text('bus_config', '', 'bus.yml whose devices are simulated')
    if not path:
        raise CanopenError(
            'no bus_config: give the path of a bus.yml with --ros-args -p bus_config:=FILE'
        )
    bus = load_bus(path)
    for warning in bus.warnings:
        node.get_logger().warning(str(warning))
    memory = memories(node)
    add_devices(host, bus, _positions(node, bus), memory)
    drives = sum(device.drive is not None for device in host.devices)
    others = len(host.devices) - drives
    what = f'{drives} simulated drives' + (f' and {others} other devices' if others else '')
    return SimulatedDevices(what, {config.name: config.node_id for config in bus.nodes})


def _positions(node: Node, bus: BusConfig) -> dict[str, float]:
    read = ParameterReader(node, 'positions.')
    return {
        axis.name: read.number(
            axis.name,
            axis.offset_pos_from_dev,  # of 0 increments
            None,
            'position at power-on in the units of bus.yml [rad or m]',
        )
        for config in bus.nodes
        if config.is_drive
        for axis in config.axes
    }


if __name__ == '__main__':
    main()
