# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the nodes of simulated slaves have in common: their parameters, bus and life."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
import threading

from rclpy.node import Node

from arm_canopen import CanopenError
from arm_canopen.can import open_bus
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

from ..faults.scenario import ScenarioPlayer
from ..faults.scenario_file import load_scenario
from ..host import DeviceHost
from ..node_id_check import NodeIdCheck
from ..objects.parameter_memory import ParameterFile, ParameterMemory
from ..runner import DeviceRunner
from .fault_services import FaultServices

CAN_INTERFACES = (
    'can0, vcan0, udp_multicast:239.x.y.z[:port], auto, or INTERFACE:CHANNEL[@BITRATE]'
)

THREAD_PRIORITY = 30  # SCHED_FIFO: devices answer SYNC in time, and leave the master the way
STORE_DIRECTORY = 'folder of what the devices store (0x1010, LSS); empty: until they end'
SCENARIO = 'YAML file with faults and their times; empty for none'
COMMON_HELP = f"""\
  can_interface_name  {CAN_INTERFACES}
                      (default auto: vcan0 where it exists, otherwise multicast on this host)
  scenario            {SCENARIO}
  store_directory     {STORE_DIRECTORY}
  thread_priority     SCHED_FIFO priority of the loop of the devices, 0 for none
                      (default {THREAD_PRIORITY})

services of the node, of all devices and below ~/<device>/ of each:
  ~/fault (arm_msgs/srv/InjectFault), ~/power_cycle (std_srvs/srv/Trigger),
  ~/sto (std_srvs/srv/SetBool)
"""


@dataclass(frozen=True, slots=True)
class SimulatedDevices:
    """The devices of a process.

    Attributes:
        what: What they are, for the log.
        names: Their node ids by name.
    """

    what: str
    names: Mapping[str, int]


Populate = Callable[[Node, DeviceHost], SimulatedDevices]


def memories(node: Node) -> Callable[[int], ParameterMemory]:
    """Declare ``store_directory``; return what gives each device its memory, by node id."""
    folder = ParameterReader(node).text('store_directory', '', STORE_DIRECTORY)

    def memory(node_id: int) -> ParameterMemory:
        return (
            ParameterFile(Path(folder) / f'node_{node_id}.json') if folder else ParameterMemory()
        )

    return memory


def run_slaves(
    name: str, populate: Populate, *, help_text: str, args: Sequence[str] | None = None
) -> int:
    """Run simulated slaves until Ctrl-C or SIGTERM.

    Args:
        name: Name of the node.
        populate: Reads the node's parameters, adds the devices and returns what they are.
        help_text: What ``--help`` prints, before the parameters that all of them have.
        args: Command line; None for the process's own.

    Returns:
        Exit code: 0, or 1 when the devices could not be described or the bus not be opened.
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
    interface = ParameterReader(node).text('can_interface_name', 'auto', CAN_INTERFACES)
    with open_bus(interface) as bus:
        runner = DeviceRunner(bus)
        population = populate(node, runner.host)
        check = NodeIdCheck(bus, [device.node_id for device in runner.host.devices])
        _play_scenario(node, runner.host, population)
        priority = declare_thread_priority(ParameterReader(node), THREAD_PRIORITY)
        refuse_misspelt(node)
        FaultServices(node, runner, population.names)
        settle_process_memory(node)
        check.finish()
        runner.start(
            lambda: raise_thread_priority(node, priority, 'the loop of the simulated devices')
        )
        try:
            node.get_logger().info(f'{population.what} on {bus.name}')
            notify_ready()
            spin([node], stop)
        finally:
            runner.stop()


def _play_scenario(node: Node, host: DeviceHost, population: SimulatedDevices) -> None:
    path = ParameterReader(node).text('scenario', '', SCENARIO)
    if not path:
        return
    drives = frozenset(device.node_id for device in host.devices if device.drive is not None)
    steps = load_scenario(path, population.names, drives)
    host.observers.append(ScenarioPlayer(host, steps, node.get_logger().info))
    node.get_logger().info(f'{len(steps)} steps of {path} will be played')
