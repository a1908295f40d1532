# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_canopen master``: the master and all drives of one bus.yml or of several."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from dataclasses import dataclass
import sys
import threading

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
import rclpy
from rclpy.exceptions import ParameterException
from rclpy.logging import get_logger
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from ..can import open_bus
from ..can.bus import Bus
from ..config import load_bus
from ..config.checks import check_bus
from ..config.model import BusConfig
from ..exceptions import CanopenError
from .managed_bus import MANAGER
from .master_process import MasterProcess
from .misspelt import refuse_misspelt
from .spinning import make_executor, stop_on_signals, WAKE_PERIOD

SWITCH_INTERVAL = 0.0005  # [s] how long a busy callback may keep the interpreter from the cycle

Extend = Callable[[MasterProcess], Sequence[Node]]


def run_master(args: Sequence[str] | None = None, *, extend: Extend | None = None) -> int:
    """Run a bus until Ctrl-C or SIGTERM, then stop and disable its drives.

    Args:
        args: Command line; None for the process's own.
        extend: Called with the process of each bus before it starts; returns further nodes for
            the executor, which may attach motion sources.

    Returns:
        Exit code: 0, or 1 when the bus could not be configured or opened, or has a master.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    rclpy.init(
        args=None if args is None else list(args), signal_handler_options=SignalHandlerOptions.NO
    )
    stop = stop_on_signals()
    try:
        _run(stop, extend)
    except (CanopenError, ParameterException) as error:
        get_logger('master').fatal(str(error))
        return 1
    finally:
        try_shutdown()
    return 0


def main() -> None:
    """Entry point."""
    sys.exit(run_master())


@dataclass(frozen=True, slots=True)
class Parameters:
    """Parameters of the program.

    Attributes:
        bus_configs: Paths of the bus.yml files, one for each bus.
        can_names: Names of the CAN interfaces, in the same order.
        diagnostics_period: Time between two /diagnostics messages in [s].
        beside_master: Start although another master is heard on the bus.
    """

    bus_configs: list[str]
    can_names: list[str]
    diagnostics_period: float
    beside_master: bool


def _run(stop: threading.Event, extend: Extend | None) -> None:
    first = Node('master')
    try:
        parameters = _declare(first)
    finally:
        first.destroy_node()  # bus.yml, which is known from here on, says in which namespace it is
    configs = [load_bus(path) for path in parameters.bus_configs]
    _check_names(configs)
    with ExitStack() as stack:
        processes = []
        for config, name in zip(configs, parameters.can_names, strict=True):
            can = stack.enter_context(open_bus(name))
            processes.append(_make_process(config, can, stack))
        _serve(processes, stop, extend)


def _make_process(config: BusConfig, can: Bus, stack: ExitStack) -> MasterProcess:
    node = Node('master', namespace=config.master.namespace or None)
    stack.callback(node.destroy_node)
    parameters = _declare(node)
    for warning in (*config.warnings, *check_bus(config).warnings):
        node.get_logger().warning(str(warning))
    node.get_logger().info(f'{len(config.nodes)} devices of {config.file} on {can.name}')
    return MasterProcess(
        node,
        config,
        can,
        diagnostics_period=parameters.diagnostics_period,
        beside_master=parameters.beside_master,
    )


def _serve(
    processes: Sequence[MasterProcess], stop: threading.Event, extend: Extend | None
) -> None:
    executor = make_executor()
    nodes = [node for process in processes for node in process.nodes]
    if extend is not None:
        nodes += [node for process in processes for node in extend(process)]
    for node in nodes:
        executor.add_node(node)
    try:
        with ThreadPoolExecutor() as pool:  # all buses before the first word on any of them
            list(pool.map(MasterProcess.listen, processes))
        for process in processes:
            process.start()
        while not stop.is_set():
            executor.spin_once(timeout_sec=WAKE_PERIOD)
    finally:
        with ThreadPoolExecutor() as pool:  # no bus waits for the drives of another to stop
            list(pool.map(MasterProcess.stop, processes))
        executor.shutdown()
        masters = [process.nodes[0] for process in processes]
        for node in nodes:
            if node not in masters:
                node.destroy_node()


def _check_names(configs: Sequence[BusConfig]) -> None:
    """Refuse two nodes of one name, which would answer each other's services."""
    taken: set[tuple[str, str]] = set()
    for config in configs:
        namespace = config.master.namespace.strip('/')
        names = [(namespace, 'master')]
        if config.master.is_lifecycle:
            names.append((namespace, MANAGER))
        names += [(node.namespace.strip('/'), node.name) for node in config.nodes]
        for name in names:
            if name in taken:
                raise CanopenError(
                    f'{config.file}: there is a node {"/".join(name).lstrip("/")!r} on another '
                    "bus already; give master and defaults of each bus a 'namespace'"
                )
            taken.add(name)


def _declare(node: Node) -> Parameters:
    def text(name: str, default: str, description: str) -> str:
        descriptor = ParameterDescriptor(description=description, read_only=True)
        return str(node.declare_parameter(name, default, descriptor).value)

    configs = text(
        'bus_config', '', 'bus.yml with the master and its devices; several with commas'
    )
    can_names = text(
        'can_interface_name',
        'auto',
        'can0, vcan0, udp_multicast:239.x.y.z[:port], auto, or INTERFACE:CHANNEL[@BITRATE]; one '
        'for each bus.yml, with commas',
    )
    text('master_config', '', 'accepted for ros2_canopen; not needed')
    text('master_bin', '', 'accepted for ros2_canopen; not needed')
    period = node.declare_parameter(
        'diagnostics_period',
        1.0,
        ParameterDescriptor(
            description='time between two /diagnostics messages [s]',
            read_only=True,
            floating_point_range=[FloatingPointRange(from_value=0.05, to_value=60.0)],
        ),
    ).value
    beside_master = node.declare_parameter(
        'beside_master',
        False,
        ParameterDescriptor(
            description='start although another master is heard, which leads other devices',
            read_only=True,
        ),
    ).value
    refuse_misspelt(node)
    if not configs:
        raise CanopenError(
            'no bus_config: give the path of a bus.yml with --ros-args -p bus_config:=FILE'
        )
    parameters = Parameters(
        configs.split(','), can_names.split(','), float(period), bool(beside_master)
    )
    if len(parameters.bus_configs) != len(parameters.can_names):
        raise CanopenError(
            f'bus_config names {len(parameters.bus_configs)} buses, can_interface_name '
            f'{len(parameters.can_names)}: give one interface for each bus.yml'
        )
    return parameters


if __name__ == '__main__':
    main()
