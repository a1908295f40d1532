# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Shared code of bring-up and demos: from the command line to a list of processes."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
import contextlib
from dataclasses import dataclass, field, replace
from functools import partial
import os
from pathlib import Path

from process_supervisor import (
    add_namespace,
    add_view,
    bring_up_place,
    exclusive,
    Executable,
    find_executable,
    FindExecutable,
    node_process,
    ProcessSpec,
    RosOptions,
    StartError,
    state_publisher,
    view_process,
    write_parameters,
)
from process_supervisor.ros_options import add_network, add_timeout, apply_network

from .groups import moved_groups, start_positions, StartPositions
from .robots import (
    find_robot,
    in_namespace_of_bus,
    installed_robots_folder,
    read_bus,
    read_description,
    Robot,
    robot_names,
    RobotError,
    stream_mode_service,
)

REAL_BUS = 'can0'
"""Default bus on hardware; never a bus that can only have simulated drives."""
SIMULATED_BUS = 'auto'
"""Default bus in simulation: vcan0 if it exists, else multicast on the loopback."""
BUS_REMEDY = 'another bus with --can'  # remedy for a second bring-up on the same bus


@dataclass(frozen=True, slots=True)
class Session:
    """Settings of an arm that is ready to be brought up."""

    robot: Robot
    bus: str  # name of its CAN bus, no longer ``auto``
    drives: list[str]  # in the order of bus.yml
    ros: RosOptions  # options of all nodes
    mode_service: str  # selects the mode in which all of them follow a stream
    urdf: str
    start: str  # where the simulated drives stand at power-on, and why, for the log
    processes: list[ProcessSpec]


def add_arguments(parser: argparse.ArgumentParser, *, default_bus: str) -> None:
    """Declare the arguments that bring-up and demos share."""
    add_robot(parser)
    parser.add_argument(
        '--can',
        metavar='NAME',
        help='CAN bus: can0, vcan0, udp_multicast[:239.x.y.z[:PORT]], auto, or an adapter of '
        f'python-can as INTERFACE:CHANNEL@BITRATE (default: {default_bus})',
    )
    add_namespace(parser)
    add_view(parser)
    add_network(parser)
    add_timeout(parser)


def add_robot(parser: argparse.ArgumentParser) -> None:
    """Declare the arguments that select the robot; :func:`locate` reads them."""
    parser.add_argument(
        'robot',
        help='name of a robot, or path of a robot folder (with a slash, e.g. ./my_arm)',
    )
    parser.add_argument(
        '--group',
        metavar='NAME',
        action='append',
        default=[],
        help='group of the SRDF to move; may be given several times, the first is the main one '
        '(default: group of robot.yaml, else all arms that have drives)',
    )
    parser.add_argument(
        '--xacro-arg',
        metavar='NAME:=VALUE',
        action='append',
        default=[],
        type=_xacro_arg,
        help='value of a xacro argument of description and SRDF; may be given several times '
        '(default: xacro_args of robot.yaml)',
    )


def _xacro_arg(text: str) -> tuple[str, str]:
    name, assigned, value = text.partition(':=')
    if not name or not assigned:
        raise argparse.ArgumentTypeError(f'{text!r} is not NAME:=VALUE')
    return name, value


def robots_epilog() -> str:
    """Return a help text that lists the installed robots."""
    with contextlib.suppress(RobotError):
        return 'robots: ' + ', '.join(robot_names(installed_robots_folder()))
    return ''


def locate(arguments: argparse.Namespace) -> Robot:
    """Find the robot given by the arguments of :func:`add_robot`, which override its folder.

    Raises:
        RobotError: The robot does not exist; the message lists those that exist.
    """
    folder = Path() if os.sep in arguments.robot else installed_robots_folder()
    robot = find_robot(arguments.robot, folder)
    groups = tuple(arguments.group) or robot.groups
    tip_link = robot.tip_link
    if arguments.group and tip_link:  # it is of the group that is the main one without --group
        main = (robot.groups or moved_groups(robot).arms)[0]
        tip_link = tip_link if groups[0] == main else ''
    return replace(
        robot,
        groups=groups,
        tip_link=tip_link,
        xacro_args={**robot.xacro_args, **dict(arguments.xacro_arg)},
    )


def no_files(robot: Robot, folder: Path, ros: RosOptions) -> Sequence[Path]:
    """Write no parameter files; a default for :func:`session`."""
    del robot, folder, ros
    return ()


@contextlib.contextmanager
def own_bus(wanted: str | None, *, simulate: bool) -> Iterator[str]:
    """Lock a bus while the block runs; in simulation, ``auto`` selects an unused bus.

    Raises:
        StartError: Another bring-up uses the bus.
    """
    from canopen_core.can import AUTO, auto_names, resolve_name

    wanted = wanted or (SIMULATED_BUS if simulate else REAL_BUS)
    names = auto_names() if simulate and wanted == AUTO else iter([resolve_name(wanted)])
    with contextlib.ExitStack() as stack:
        yield _first_free(names, stack)


def _first_free(names: Iterator[str], stack: contextlib.ExitStack) -> str:
    """Lock the first unused bus; if all are in use, report the user of the first."""
    name = next(names)
    try:
        stack.enter_context(exclusive(f'bus {name}', BUS_REMEDY))
    except StartError as taken:
        try:
            return _first_free(names, stack)
        except StopIteration:
            raise taken from None
    return name


@contextlib.contextmanager
def session(
    robot: Robot,
    arguments: argparse.Namespace,
    ros: RosOptions,
    *,
    simulate: bool,
    master: Executable,
    master_parameters: Mapping[str, str] | None = None,
    master_files: Callable[[Robot, Path, RosOptions], Sequence[Path]] = no_files,
    plan: bool = False,
) -> Iterator[Session]:
    """Prepare a bring-up, with exclusive bus and namespace while the block runs.

    Args as in :class:`Stack`; ``master_files`` writes files to a folder that exists as long.

    Raises:
        RobotError: The robot's bus.yml is invalid.
        DescriptionError: The robot's xacro file cannot be expanded.
        StartError: An executable or a network is missing, or another bring-up uses this bus or
            this namespace in the ROS domain.
    """
    apply_network(arguments)
    config = read_bus(robot)
    ros = in_namespace_of_bus(ros, config)
    with (
        bring_up_place('arm_bringup', ros) as folder,
        own_bus(arguments.can, simulate=simulate) as bus,
    ):
        urdf = read_description(robot)
        parameters = folder / 'robot_description.yaml'
        write_parameters(parameters, urdf)
        start = start_positions(robot, urdf, config.joints) if simulate else StartPositions()
        wanted = Stack(
            robot,
            bus,
            simulate,
            start.positions,
            arguments.timeout,
            master,
            dict(master_parameters or {}),
            master_files(robot, folder, ros),
            ros,
            plan,
            arguments.view,
        )
        processes = arm_processes(wanted, parameters, find_executable)
        mode_service = stream_mode_service(config)
        yield Session(
            robot, bus, list(config.joints), ros, mode_service, urdf, f'{start}', processes
        )


MASTER = Executable('arm_canopen', 'master')
"""Default program that runs the bus."""
MOTION_NODE = Executable('arm_servo', 'motion_node')
"""Program for trajectories and jogging, with a built-in master or for drives elsewhere."""
PLANNER = Executable('arm_planning', 'move_group')
"""Program that plans motions among obstacles, for clients of MoveIt."""
SLAVES = Executable('canopen_sim', 'fake_slaves')  # simulated drives

MAKE_MOVE = 'build arm_servo (make build) for trajectories and jogging'

MASTER_FIRST, THEN_LISTENERS, SLAVES_LAST = range(3)
"""Stop order: the master before the simulated drives, which it disables."""


@dataclass(frozen=True, slots=True)
class Stack:
    """Configuration of the processes of a bring-up."""

    robot: Robot
    bus: str  # name of the CAN bus
    simulate: bool  # with simulated slaves for all devices of the bus
    start_positions: Mapping[str, float] = field(default_factory=dict)  # if not 0, [rad or m]
    ready_timeout: float = 30.0  # for each process in [s]
    master: Executable = MASTER  # what runs the bus
    master_parameters: Mapping[str, str] = field(default_factory=dict)  # additional parameters
    master_files: Sequence[Path] = ()  # additional parameter files
    ros: RosOptions = field(default_factory=RosOptions)  # of all nodes
    plan: bool = False  # with move_group, which has the files of the master
    view: bool = False  # with the page on which the robot is seen


def arm_processes(stack: Stack, parameters: Path, find: FindExecutable) -> list[ProcessSpec]:
    """Return the processes of an arm, which start in parallel."""
    make = partial(node_process, find=find, ros=stack.ros, ready_timeout=stack.ready_timeout)
    bus = {'bus_config': str(stack.robot.bus_config), 'can_interface_name': stack.bus}
    own = {'backend': 'canopen'} if stack.master == MOTION_NODE else {'robot_joint_states': 'true'}
    files = (parameters, *stack.master_files)
    processes: list[ProcessSpec | None] = []
    if stack.simulate:
        places = {f'positions.{name}': f'{at!r}' for name, at in stack.start_positions.items()}
        processes.append(make('slaves', SLAVES, values={**bus, **places}, stop_order=SLAVES_LAST))
    processes += [
        make(
            'master',
            stack.master,
            values={**bus, **own, **stack.master_parameters},
            parameters=files,
            stop_order=MASTER_FIRST,
        ),
        state_publisher(  # without it there is no TF of the arm
            parameters, find, stack.ros, ready_timeout=stack.ready_timeout, order=THEN_LISTENERS
        ),
    ]
    if stack.plan:
        processes.append(make('planner', PLANNER, parameters=files, stop_order=THEN_LISTENERS))
    if stack.view:
        timeout = stack.ready_timeout
        view = view_process(find, stack.ros, ready_timeout=timeout, stop_order=THEN_LISTENERS)
        processes.append(view)
    return [spec for spec in processes if spec is not None]


def controller_process(
    files: Sequence[Path],
    parameters: Path,
    ready_timeout: float,
    find: FindExecutable,
    ros: RosOptions,
) -> ProcessSpec:
    """Return the process that moves drives of another process, which also publishes /tf."""
    return node_process(
        'controller',
        MOTION_NODE,
        find,
        ros,
        values={'backend': 'topics'},
        parameters=(parameters, *files),
        ready_timeout=ready_timeout,
        stop_order=MASTER_FIRST,
    )


def choose_master(robot: Robot, find: FindExecutable) -> tuple[Executable, str]:
    """Choose the program that runs the bus; return it, and why it offers no motion, if so."""
    if find(MOTION_NODE.package, MOTION_NODE.name) is None:
        return MASTER, MAKE_MOVE
    if robot.lacking:
        return MASTER, f'{robot.name} lacks {robot.lacking} for trajectories and jogging'
    return MOTION_NODE, ''


def enabling_services(drives: Sequence[str], mode_service: str) -> list[list[str]]:
    """Return the services that enable drives, as groups: parallel within, one after another."""
    return [[f'{drive}/{name}' for drive in drives] for name in ('init', mode_service)]
