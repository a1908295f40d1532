# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_canopen master``: the master and all drives of a bus.yml."""

from __future__ import annotations

from collections.abc import Callable, Sequence
import sys
import threading

from rcl_interfaces.msg import FloatingPointRange, ParameterDescriptor
import rclpy
from rclpy.node import Node
from rclpy.signals import SignalHandlerOptions
from rclpy.utilities import try_shutdown

from ..can import open_bus
from ..config import load_bus
from ..exceptions import CanopenError
from .master_process import MasterProcess
from .spinning import make_executor, stop_on_signals, WAKE_PERIOD

SWITCH_INTERVAL = 0.0005  # [s] how long a busy callback may keep the interpreter from the cycle

Extend = Callable[[MasterProcess], Sequence[Node]]


def run_master(args: Sequence[str] | None = None, *, extend: Extend | None = None) -> int:
    """Run a bus until Ctrl-C or SIGTERM, then stop and disable its drives.

    Args:
        args: Command line; None for the process's own.
        extend: Called with the process before it starts; returns further nodes for its executor,
            which may attach motion sources.

    Returns:
        Exit code: 0, or 1 when the bus could not be configured or opened.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    rclpy.init(
        args=None if args is None else list(args), signal_handler_options=SignalHandlerOptions.NO
    )
    stop = stop_on_signals()
    node = Node('master')
    try:
        return _run(node, stop, extend)
    except CanopenError as error:
        node.get_logger().fatal(str(error))
        return 1
    finally:
        node.destroy_node()
        try_shutdown()


def main() -> None:
    """Entry point."""
    sys.exit(run_master())


def _run(node: Node, stop: threading.Event, extend: Extend | None) -> int:
    bus_config, can_name, diagnostics_period = _parameters(node)
    config = load_bus(bus_config)
    for warning in config.warnings:
        node.get_logger().warning(str(warning))
    with open_bus(can_name) as can:
        process = MasterProcess(node, config, can, diagnostics_period=diagnostics_period)
        nodes = [*process.nodes, *(extend(process) if extend is not None else ())]
        executor = make_executor()
        for entry in nodes:
            executor.add_node(entry)
        node.get_logger().info(f'{len(config.nodes)} devices of {config.file} on {can.name}')
        process.start()
        try:
            while not stop.is_set():
                executor.spin_once(timeout_sec=WAKE_PERIOD)
        finally:
            node.get_logger().info('stopping: quick stop, then disable')
            process.stop()
            executor.shutdown()
            for entry in nodes[1:]:
                entry.destroy_node()
    return 0


def _parameters(node: Node) -> tuple[str, str, float]:
    def text(name: str, default: str, description: str) -> str:
        descriptor = ParameterDescriptor(description=description, read_only=True)
        return str(node.declare_parameter(name, default, descriptor).value)

    bus_config = text('bus_config', '', 'bus.yml with the master and its devices')
    can_name = text(
        'can_interface_name',
        'auto',
        'can0, vcan0, udp_multicast:239.x.y.z[:port], auto, or INTERFACE:CHANNEL[@BITRATE]',
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
    if not bus_config:
        raise CanopenError(
            'no bus_config: give the path of a bus.yml with --ros-args -p bus_config:=FILE'
        )
    return bus_config, can_name, float(period)


if __name__ == '__main__':
    main()
