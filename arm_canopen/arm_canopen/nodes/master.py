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

from rclpy.node import Node

from black_box import BlackBoxSettings
from canopen_core import CanopenError
from canopen_core.can import Bus, open_bus
from node_runner import (
    declare_black_box,
    declare_thread_priority,
    LINGER,
    log_as,
    log_defects,
    ParameterReader,
    refuse_misspelt,
    run_program,
    settle_process_memory,
    spin,
)

from ..canopen_master import THREAD_PRIORITY
from ..config import load_bus
from ..config.model import BusConfig
from ..config.model.checks import check_bus
from ..master.lifecycle import MANAGER
from .master_process import MasterProcess

SWITCH_INTERVAL = 0.0005  # [s] how long a busy callback may keep the interpreter from the cycle
HELP = f"""\
Run the CANopen master and the drives of a bus.yml until Ctrl-C, then stop and disable the drives.

usage: ros2 run arm_canopen master --ros-args -p bus_config:=FILE [-p NAME:=VALUE ...]

example:
  ros2 run arm_canopen master --ros-args -p bus_config:=bus.yml -p can_interface_name:=can0

parameters:
  bus_config          bus.yml with the master and its devices (required); several with commas
  can_interface_name  can0, vcan0, udp_multicast:239.x.y.z[:port], auto, or
                      INTERFACE:CHANNEL[@BITRATE]; one for each bus.yml, with commas
                      (default auto: vcan0 where it exists, otherwise multicast on this host)
  robot_joint_states  publish the joints of all drives as /joint_states (default false)
  robot_description   URDF as XML text, for /joint_states (default: the topic robot_description)
  diagnostics_period  time between two /diagnostics messages in [s] (default 1.0)
  thread_priority     SCHED_FIFO priority of the thread of the cycle, 0 for none
                      (default {THREAD_PRIORITY})
  black_box_window    what is written when a fault happens: the last [s] of the bus, 0 for nothing
                      (default 60)
  black_box_folder    where to (default ~/.ros/log/black_box, or where the logs of ROS go)
  beside_master       start although another master is on the bus (default false)
  master_config, master_bin
                      accepted for ros2_canopen; not needed
"""

Extend = Callable[[MasterProcess], Sequence[Node]]


def run_master(
    args: Sequence[str] | None = None,
    *,
    extend: Extend | None = None,
    errors: Sequence[type[Exception]] = (),
) -> int:
    """Run a bus until Ctrl-C or SIGTERM, then stop and disable its drives.

    Args:
        args: Command line; None for the process's own.
        extend: Called with the process of each bus before it starts; returns further nodes for
            the executor, which may attach motion sources.
        errors: Exceptions of ``extend`` that are logged in one line.

    Returns:
        Exit code: 0, or 1 if the bus could not be configured or opened, already has a master, or a
        defect ended its cycle.
    """
    sys.setswitchinterval(SWITCH_INTERVAL)
    return run_program(
        'master',
        lambda stop: serve_buses(stop, extend),
        CanopenError,
        *errors,
        args=args,
        help_text=HELP,
    )


def main() -> None:
    """Entry point."""
    sys.exit(run_master())


@dataclass(frozen=True, slots=True)
class Parameters:
    """Parameters of the program; :data:`HELP` describes them."""

    bus_configs: list[str]  # one for each bus
    can_names: list[str]  # in the same order
    diagnostics_period: float
    thread_priority: int
    beside_master: bool
    robot_joint_states: bool
    robot_description: str
    black_box: BlackBoxSettings | None


def serve_buses(stop: threading.Event, extend: Extend | None = None) -> None:
    """Run the buses that the parameters name until ``stop`` is set; ROS is already initialised.

    Then stop and disable all drives; ``extend`` as for :func:`run_master`.

    Raises:
        CanopenError: A bus could not be configured or opened, already has a master, or a defect
            ended its cycle.
    """
    first = Node('master')
    try:
        parameters = _declare(first)
        named = first.get_namespace().strip('/')  # of __ns, which goes before any bus.yml
    finally:
        first.destroy_node()  # bus.yml, which is known from here on, says in which namespace it is
    configs = [load_bus(path) for path in parameters.bus_configs]
    _check_names(configs, named)
    with ExitStack() as stack:
        processes = []
        for config, name in zip(configs, parameters.can_names, strict=True):
            can = stack.enter_context(open_bus(name))
            processes.append(_make_process(config, can, stack))
        _serve(processes, stop, extend)


def _make_process(config: BusConfig, can: Bus, stack: ExitStack) -> MasterProcess:
    node = Node('master', namespace=config.master.namespace or None)
    stack.callback(node.destroy_node)
    log_as(node)
    parameters = _declare(node)
    for warning in (*config.warnings, *check_bus(config).warnings):
        node.get_logger().warning(str(warning))
    node.get_logger().info(f'{len(config.nodes)} devices of {config.file} on {can.name}')
    process = MasterProcess(
        node,
        config,
        can,
        diagnostics_period=parameters.diagnostics_period,
        thread_priority=parameters.thread_priority,
        beside_master=parameters.beside_master,
        black_box=parameters.black_box,
    )
    if parameters.robot_joint_states:
        process.publish_robot_joint_states(parameters.robot_description)
    for other in process.nodes[1:]:
        stack.callback(other.destroy_node)
    return process


def _serve(
    processes: Sequence[MasterProcess], stop: threading.Event, extend: Extend | None
) -> None:
    with ExitStack() as stack:
        nodes = [node for process in processes for node in process.nodes]
        others: list[Node] = []
        if extend is not None:
            for node in (node for process in processes for node in extend(process)):
                stack.callback(node.destroy_node)
                others.append(node)
        # it takes long: between listening and the first frame another master could come
        settle_process_memory(nodes[0])
        try:
            with ThreadPoolExecutor() as pool:  # all buses before the first frame on any of them
                list(pool.map(MasterProcess.listen, processes))
            for process in processes:
                process.end_on_failure(stop)
                process.start()
            spin([*nodes, *others], stop, survive=log_defects(nodes[0]))
        finally:
            _stop(processes, others)
        for process in processes:
            if process.failure is not None:
                raise process.failure


def _stop(processes: Sequence[MasterProcess], others: Sequence[Node]) -> None:
    """Stop the drives while the other nodes end the goals and requests of their clients."""
    stopped = threading.Event()

    def stop() -> None:
        try:
            with ThreadPoolExecutor() as pool:  # no bus waits for the drives of another to stop
                list(pool.map(MasterProcess.stop, processes))
        finally:
            stopped.set()

    with ThreadPoolExecutor(1) as pool:
        stopping = pool.submit(stop)
        survive = log_defects(others[0]) if others else None
        spin(others, stopped, linger=LINGER if others else 0.0, survive=survive)
        stopping.result()


def _check_names(configs: Sequence[BusConfig], named: str) -> None:
    """Reject duplicate node names: such nodes would answer each other's services.

    ``named`` is the namespace that the command line gives to all nodes; empty for none.
    """
    taken: set[tuple[str, str]] = set()
    for config in configs:
        namespace = named or config.master.namespace.strip('/')
        names = [(namespace, 'master')]
        if config.master.is_lifecycle:
            names.append((namespace, MANAGER))
        names += [(named or node.namespace.strip('/'), node.name) for node in config.nodes]
        for name in names:
            if name in taken:
                raise CanopenError(
                    f'{config.file}: there is a node {"/".join(name).lstrip("/")!r} on another '
                    "bus already; set 'namespace' in the sections master and defaults of each file"
                )
            taken.add(name)


def _declare(node: Node) -> Parameters:
    read = ParameterReader(node)
    configs = read.text(
        'bus_config', '', 'bus.yml with the master and its devices; several with commas'
    )
    can_names = read.text(
        'can_interface_name',
        'auto',
        'can0, vcan0, udp_multicast:239.x.y.z[:port], auto, or INTERFACE:CHANNEL[@BITRATE]; one '
        'for each bus.yml, with commas',
    )
    read.text('master_config', '', 'accepted for ros2_canopen; not needed')
    read.text('master_bin', '', 'accepted for ros2_canopen; not needed')
    parameters = Parameters(
        bus_configs=configs.split(','),
        can_names=can_names.split(','),
        diagnostics_period=read.number(
            'diagnostics_period', 1.0, (0.05, 60.0), 'time between two /diagnostics messages [s]'
        ),
        thread_priority=declare_thread_priority(read, THREAD_PRIORITY),
        beside_master=read.flag(
            'beside_master',
            'start although another master is found, which leads other devices',
            default=False,
        ),
        robot_joint_states=read.flag(
            'robot_joint_states',
            'publish the joints of all drives as joint_states; for an arm with one master, in the '
            'place of canopen_joint_state_publisher',
            default=False,
        ),
        robot_description=read.text(
            'robot_description',
            '',
            'URDF as XML text, for the order of joint_states and the joints that mimic others; '
            'without it, the topic robot_description',
        ),
        black_box=declare_black_box(read),
    )
    refuse_misspelt(node)
    if not configs:
        raise CanopenError(
            'no bus_config: give the path of a bus.yml with --ros-args -p bus_config:=FILE'
        )
    if len(parameters.bus_configs) != len(parameters.can_names):
        raise CanopenError(
            f'bus_config names {len(parameters.bus_configs)} buses, can_interface_name '
            f'{len(parameters.can_names)}: give one interface for each bus.yml'
        )
    return parameters


if __name__ == '__main__':
    main()
