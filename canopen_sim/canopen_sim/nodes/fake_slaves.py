# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run canopen_sim fake_slaves``: simulated devices for all slaves of a bus.yml.

Services of the node inject faults.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import TimeoutError as FutureTimeoutError
from functools import partial
from pathlib import Path
import re
import sys
import threading
import time
from typing import Any

from rclpy.node import Node
from std_srvs.srv import SetBool, Trigger

from arm_canopen.config import BusConfig, load_bus
from arm_msgs.srv import InjectFault
from canopen_core import BusError, CanopenError
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

from ..deviations import Fault, FaultInjection, parse_fault, unknown
from ..device import Device
from ..host import add_devices, DeviceHost, DeviceRunner, NodeIdCheck
from ..object_store import ParameterMemory

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
"""Adds the devices of a node; returns their description, and their node ids by name."""


def main() -> None:
    """Entry point."""
    sys.exit(run_slaves('fake_slaves', _populate, help_text=HELP))


def run_slaves(
    name: str, populate: Populate, *, help_text: str, args: Sequence[str] | None = None
) -> int:
    """Run the simulated devices of a node until Ctrl-C or SIGTERM; return the exit code.

    ``populate`` reads the parameters of the node and adds the devices. The exit code is 1 if
    this fails or the bus cannot be opened.
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
    """Declare ``store_directory``; return a function that creates the memory of a node id."""
    folder = ParameterReader(node).text('store_directory', '', STORE_DIRECTORY)

    def memory(node_id: int) -> ParameterMemory:
        return ParameterMemory(Path(folder) / f'node_{node_id}.json' if folder else None)

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


ANSWER_TIMEOUT = 5.0  # [s] the thread of the devices answers within milliseconds
POWER_CYCLE_TIME = 0.5  # [s] how long the power is off
ALL_FAULTS = 'none'  # instead of a fault: none shall go on
NOT_IN_NAMES = re.compile(r'[^A-Za-z0-9_]')

Work = Callable[[Device, float], str]


class FaultServices:
    """The services ``~/fault``, ``~/power_cycle`` and ``~/sto``, for all devices and for each."""

    def __init__(self, node: Node, runner: DeviceRunner, names: Mapping[str, int]) -> None:
        """Offer the services; ``names`` maps device names to node ids."""
        self._node = node
        self._runner = runner
        self._names = dict(names)
        self._create('~', '')
        for name in self._names:
            self._create(f'~/{service_part(name)}', name)

    def _create(self, prefix: str, name: str) -> None:
        create = self._node.create_service
        create(InjectFault, f'{prefix}/fault', partial(self._on_fault, name))
        create(Trigger, f'{prefix}/power_cycle', partial(self._on_power_cycle, name))
        create(SetBool, f'{prefix}/sto', partial(self._on_sto, name))

    # message classes have no types
    def _on_fault(self, name: str, request: Any, response: Any) -> Any:  # noqa: ANN401
        def begin() -> str:
            work: Work = end_faults
            if request.fault != ALL_FAULTS:
                work = injecting(parse_fault(request.fault, request.settings, request.duration))
            return self._do(request.device or name, work)

        return self._answer(response, begin)

    def _on_power_cycle(self, name: str, _request: Any, response: Any) -> Any:  # noqa: ANN401
        injection = FaultInjection(Fault.POWER_OFF, duration=POWER_CYCLE_TIME)
        return self._answer(response, lambda: self._do(name, injecting(injection)))

    def _on_sto(self, name: str, request: Any, response: Any) -> Any:  # noqa: ANN401
        active = bool(request.data)
        return self._answer(response, lambda: self._do(name, partial(switch_sto, active)))

    def _do(self, name: str, work: Work) -> str:
        """Run an action on a device, or on all devices, in their thread.

        Raises:
            ValueError: The device is unknown, or does not support the action.
        """
        node_ids = self._node_ids(name)

        def run() -> list[str]:
            now = time.monotonic()
            host = self._runner.host
            results = [work(host.device(node_id), now) for node_id in node_ids]
            return list(dict.fromkeys(results))

        results = self._runner.call(run).result(ANSWER_TIMEOUT)
        who = f'{len(node_ids)} devices' if len(node_ids) != 1 else name or next(iter(self._names))
        return f'{who}: {"; ".join(results)}'

    def _node_ids(self, name: str) -> list[int]:
        if not name:
            return list(self._names.values())
        if name in self._names:
            return [self._names[name]]
        numbers = {str(node_id): node_id for node_id in self._names.values()}
        if name in numbers:
            return [numbers[name]]
        raise ValueError(unknown('device', name, self._names))

    def _answer(self, response: Any, work: Callable[[], str]) -> Any:  # noqa: ANN401
        try:
            response.message = work()
            response.success = True
        except (ValueError, FutureTimeoutError, BusError) as error:
            response.message = str(error) or 'the simulated devices do not run'
            response.success = False
        logger = self._node.get_logger()
        # two calls, as rclpy allows one severity to each place in the code
        if response.success:
            logger.info(response.message)
        else:
            logger.warning(response.message)
        return response


def service_part(name: str) -> str:
    """Return a device's name as a part of a ROS name (REP 144 has letters, digits and ``_``)."""
    part = NOT_IN_NAMES.sub('_', name)
    return part if part[:1].isalpha() else f'device_{part}'


def injecting(injection: FaultInjection) -> Work:
    """Return an action that injects a fault."""

    def inject(device: Device, now: float) -> str:
        device.faults.inject(injection, now)
        return str(injection)

    return inject


def end_faults(device: Device, now: float) -> str:
    """End all faults of a device."""
    ended = [injection.fault.label for injection in device.faults.active]
    device.faults.end(now)
    return f'ended: {", ".join(ended)}' if ended else 'no fault was active'


def switch_sto(active: bool, device: Device, now: float) -> str:
    """Activate or release safe torque off of a drive.

    Raises:
        ValueError: The device is not a drive.
    """
    if active:
        device.faults.inject(FaultInjection(Fault.STO), now)
        return 'STO is active, the motor has no torque'
    if not device.drives:
        raise ValueError(f'device {device.node_id} is not a drive')
    device.faults.end(now, Fault.STO)
    return 'STO is released'


if __name__ == '__main__':
    main()
