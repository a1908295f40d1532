# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run canopen_sim fake_slaves``: simulated devices for all slaves of a bus.yml."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
import sys
import threading

from rclpy.node import Node

from arm_canopen.config import BusConfig, load_bus
from canopen_core import CanopenError
from canopen_core.can import open_bus
from node_runner import (
    declare_thread_priority,
    log_as,
    notify_ready,
    ParameterReader,
    raise_thread_priority,
    refuse_misspelt,
    run_program,
    settle_process_memory,
    spin,
)

from ..host import DeviceHost
from ..node_id_check import NodeIdCheck
from ..objects.parameter_storage import ParameterFile, ParameterMemory
from ..runner import DeviceRunner
from ..simulation import add_devices
from .fault_services import FaultServices

CAN_INTERFACES = (
    'can0, vcan0, udp_multicast:239.x.y.z[:port], auto, or INTERFACE:CHANNEL[@BITRATE]'
)
STORE_DIRECTORY = 'folder of what the devices store (0x1010); empty: until they end'
THREAD_PRIORITY = 30  # SCHED_FIFO: devices answer SYNC in time, and leave the master the way
COMMON_HELP = f"""\
  can_interface_name  {CAN_INTERFACES}
                      (default auto: vcan0 where it exists, otherwise multicast on this host)
  store_directory     {STORE_DIRECTORY}
  thread_priority     SCHED_FIFO priority of the loop of the devices, 0 for none
                      (default {THREAD_PRIORITY})

services of the node, of all devices and below ~/<device>/ of each:
  ~/fault (arm_msgs/srv/InjectFault), ~/power_cycle (std_srvs/srv/Trigger),
  ~/sto (std_srvs/srv/SetBool)
"""
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

Populate = Callable[[Node, DeviceHost], tuple[str, Mapping[str, int]]]
"""Adds the devices of a node; returns what they are in words, and their node ids by name."""


def main() -> None:
    """Entry point."""
    sys.exit(run_slaves('fake_slaves', _populate, help_text=HELP))


def run_slaves(
    name: str, populate: Populate, *, help_text: str, args: Sequence[str] | None = None
) -> int:
    """Run the simulated devices of a node until Ctrl-C or SIGTERM; return the exit code.

    ``populate`` reads the parameters of the node and adds the devices. It is 1 when they could
    not be described or the bus not be opened.
    """

    def body(stop: threading.Event) -> None:
        node = Node(name)
        log_as(node)
        try:
            _run(node, populate, stop)
        finally:
            node.destroy_node()

    return run_program(name, body, CanopenError, args=args, help_text=help_text + COMMON_HELP)


def _run(node: Node, populate: Populate, stop: threading.Event) -> None:
    read = ParameterReader(node)
    with open_bus(read.text('can_interface_name', 'auto', CAN_INTERFACES)) as bus:
        runner = DeviceRunner(bus)
        what, names = populate(node, runner.host)
        check = NodeIdCheck(bus, [device.node_id for device in runner.host.devices])
        priority = declare_thread_priority(read, THREAD_PRIORITY)
        refuse_misspelt(node)
        FaultServices(node, runner, names)
        settle_process_memory(node)
        check.finish()
        runner.start(
            lambda: raise_thread_priority(node, priority, 'the loop of the simulated devices')
        )
        try:
            node.get_logger().info(f'{what} on {bus.name}')
            notify_ready()
            spin([node], stop)
        finally:
            runner.stop()


def memories(node: Node) -> Callable[[int], ParameterMemory]:
    """Declare ``store_directory``; return a function that makes the memory of a node id."""
    folder = ParameterReader(node).text('store_directory', '', STORE_DIRECTORY)

    def memory(node_id: int) -> ParameterMemory:
        file = Path(folder) / f'node_{node_id}.json'
        return ParameterFile(file) if folder else ParameterMemory()

    return memory


def _populate(node: Node, host: DeviceHost) -> tuple[str, Mapping[str, int]]:
    path = ParameterReader(node).text('bus_config', '', 'bus.yml whose devices are simulated')
    if not path:
        raise CanopenError(
            'no bus_config: give the path of a bus.yml with --ros-args -p bus_config:=FILE'
        )
    bus = load_bus(path)
    for warning in bus.warnings:
        node.get_logger().warning(str(warning))
    add_devices(host, bus, _positions(node, bus), memories(node))
    drives = sum(device.drive is not None for device in host.devices)
    others = len(host.devices) - drives
    what = f'{drives} simulated drives' + (f' and {others} other devices' if others else '')
    return what, {config.name: config.node_id for config in bus.nodes}


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
