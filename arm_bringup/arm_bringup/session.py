# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What bring-up and demo have in common: from the command line to a list of processes."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Mapping, Sequence
import contextlib
from dataclasses import dataclass, replace
import os
from pathlib import Path

from process_supervisor import (
    add_namespace,
    add_view,
    bring_up_place,
    exclusive,
    Executable,
    find_executable,
    ProcessSpec,
    RosOptions,
    StartError,
    write_parameters,
)
from process_supervisor.ros_options import add_network, add_timeout, apply_network

from .bus import in_namespace_of_bus, read_bus, stream_mode_service
from .description import read_description
from .exceptions import RobotError
from .groups import moved_groups
from .robots import find_robot, installed_robots_folder, Robot, robot_names
from .stack import arm_processes, Stack
from .start_positions import start_positions, StartPositions

REAL_BUS = 'can0'
"""Bus without --can on hardware: never one on which only simulated drives could be."""
SIMULATED_BUS = 'auto'
"""Bus without --can in simulation: vcan0 when it exists, else multicast on the loopback."""
BUS_REMEDY = 'another bus with --can'  # what a second bring-up on a bus is advised to take


@dataclass(frozen=True, slots=True)
class Session:
    """An arm that is about to be brought up.

    Attributes:
        robot: The robot.
        bus: Name of its CAN bus, no longer ``auto``.
        drives: Names of its drives, in the order of bus.yml.
        ros: Options of all nodes.
        mode_service: Service that selects the mode in which all of them follow a stream.
        urdf: Its description.
        start: Where the simulated drives stand at power-on, and why, for the log.
        processes: What is to be run.
    """

    robot: Robot
    bus: str
    drives: list[str]
    ros: RosOptions
    mode_service: str
    urdf: str
    start: str
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
    """Find a robot of this package, or by a path.

    Args:
        arguments: What :func:`add_robot` parsed; it overrides the robot folder.

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
    """Hold a bus, as long as the block runs.

    Args:
        wanted: What was asked for; None takes the usual one.
        simulate: ``auto`` is a bus that no other bring-up has; else it is where the drives are.

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

    Args:
        arguments: What :func:`add_arguments` parsed.
        ros: Options of all nodes.
        simulate: With simulated slaves.
        master: What runs the bus.
        master_parameters: ROS parameters for it beside the usual ones.
        master_files: Makes parameter files for it, in a folder that lasts as long as the block.
        plan: With move_group.

    Raises:
        RobotError: The robot folder is unknown or incomplete.
        DescriptionError: Its xacro file cannot be expanded.
        StartError: An executable or a network is missing, or another bring-up is on this bus or
            in this namespace of the domain.
    """
    apply_network(arguments)
    robot = locate(arguments)
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
