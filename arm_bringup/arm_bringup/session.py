# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What bring-up and demos have in common: from the command line to a list of processes."""

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
"""Bus without --can on hardware: never one on which only simulated drives could be."""
SIMULATED_BUS = 'auto'
"""Bus without --can in simulation: vcan0 when it exists, else multicast on the loopback."""
BUS_REMEDY = 'another bus with --can'  # what a second bring-up on a bus is advised to take


@dataclass(frozen=True, slots=True)
class Session:
    """An arm that is about to be brought up."""

    robot: Robot
    bus: str  # name of its CAN bus, no longer ``auto``
    drives: list[str]  # in the order of bus.yml
    ros: RosOptions  # of all nodes
    mode_service: str  # selects the mode in which all of them follow a stream
    urdf: str
    start: str  # where the simulated drives stand at power-on, and why, for the log
    processes: list[ProcessSpec]


def add_arguments(parser: argparse.ArgumentParser, *, default_bus: str) -> None:
    """Declare the arguments that bring-up and demo share."""
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
    """Declare the arguments that say which robot; for :func:`locate`."""
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
    """Name the robots that are installed, for the help."""
    with contextlib.suppress(RobotError):
        return 'robots: ' + ', '.join(robot_names(installed_robots_folder()))
    return ''


def locate(arguments: argparse.Namespace) -> Robot:
    """Find the robot that :func:`add_robot` parsed, which overrides the robot folder.

    Raises:
        RobotError: There is none; the message lists those that exist.
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
    """Make no parameter files; for :func:`session`."""
    del robot, folder, ros
    return ()


@contextlib.contextmanager
def own_bus(wanted: str | None, *, simulate: bool) -> Iterator[str]:
    """Hold a bus, as long as the block runs; in simulation ``auto`` is one that nothing else has.

    Raises:
        StartError: Another bring-up is on it.
    """
    from canopen_core.can import AUTO, auto_names, resolve_name

    wanted = wanted or (SIMULATED_BUS if simulate else REAL_BUS)
    names = auto_names() if simulate and wanted == AUTO else iter([resolve_name(wanted)])
    with contextlib.ExitStack() as stack:
        yield _first_free(names, stack)


def _first_free(names: Iterator[str], stack: contextlib.ExitStack) -> str:
    """Hold the first bus that no other bring-up has; if all are taken, name who has the first."""
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
    """Prepare a bring-up; the bus and the namespace are its own as long as the block runs.

    Args as in :class:`Stack`; ``master_files`` makes files in a folder that lasts as long.

    Raises:
        RobotError: Its bus.yml is wrong.
        DescriptionError: Its xacro file cannot be expanded.
        StartError: An executable or a network is missing, or another bring-up is on this bus or
            in this namespace of the domain.
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
"""What runs the bus unless something else is asked for."""
MOTION_NODE = Executable('arm_servo', 'motion_node')
"""Trajectories and jogging: with the master in it, or for drives that another process has."""
PLANNER = Executable('arm_planning', 'move_group')
"""Motions among obstacles, for clients of MoveIt."""
SLAVES = Executable('canopen_sim', 'fake_slaves')  # simulated drives

MAKE_MOVE = 'build arm_servo (make build) for trajectories and jogging'

MASTER_FIRST, THEN_LISTENERS, SLAVES_LAST = range(3)
"""Order of stopping: the master disables the drives, so they must still be there."""


@dataclass(frozen=True, slots=True)
class Stack:
    """What is to be brought up."""

    robot: Robot
    bus: str  # name of the CAN bus
    simulate: bool  # with simulated slaves for all devices of the bus
    start_positions: Mapping[str, float] = field(default_factory=dict)  # if not 0, [rad or m]
    ready_timeout: float = 30.0  # of each process in [s]
    master: Executable = MASTER  # what runs the bus
    master_parameters: Mapping[str, str] = field(default_factory=dict)  # beside the usual ones
    master_files: Sequence[Path] = ()  # with parameters, beside the usual one
    ros: RosOptions = field(default_factory=RosOptions)  # of all nodes
    plan: bool = False  # with move_group, which has the files of the master
    view: bool = False  # with the page on which the robot is seen


def arm_processes(stack: Stack, parameters: Path, find: FindExecutable) -> list[ProcessSpec]:
    """Return the processes that make an arm; they start side by side."""
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
        state_publisher(  # without it the arm moves without TF
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
    """Return the process that moves drives of another process; that one makes /tf, too."""
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
    """Choose what runs the bus; return why it offers no motion, too: empty when it does."""
    if find(MOTION_NODE.package, MOTION_NODE.name) is None:
        return MASTER, MAKE_MOVE
    if robot.lacking:
        return MASTER, f'{robot.name} lacks {robot.lacking} for trajectories and jogging'
    return MOTION_NODE, ''


def enabling_services(drives: Sequence[str], mode_service: str) -> list[list[str]]:
    """Return the services that enable drives; each group is called side by side, one by one."""
    return [[f'{drive}/{name}' for drive in drives] for name in ('init', mode_service)]
