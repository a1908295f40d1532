# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup motion_demo``: a simulated arm is jogged and follows trajectories."""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from functools import partial
import json
from pathlib import Path
import sys

from arm_model import ArmError, load_limits, RobotModel
from demo_runner import run_demo
from process_supervisor import (
    namespaced_parameters,
    parse_with_ros,
    RosOptions,
    SupervisorError,
    USAGE_ERROR,
)
from process_supervisor.arguments import seconds_from

from ...description import joint_limits, read_semantic
from ...exceptions import BringupError, RobotError
from ...groups import moved_groups, MovedGroups
from ...motion import controller_names, motion_files
from ...robots import Robot
from ...session import (
    add_arguments,
    locate,
    robots_epilog,
    Session,
    session,
    SIMULATED_BUS,
)
from ...stack import MOTION_NODE
from ..table import ArmView
from .client import MotionClient
from .figures import MotionFigures
from .poses import choose_start
from .scenario import MotionScenario
from .view import MotionView

RATE = 100.0
"""Rate of the controller's states in [Hz]."""


def parse(argv: Sequence[str]) -> tuple[argparse.Namespace, RosOptions]:
    """Parse the command line.

    Args:
        argv: Arguments without the program's name.

    Returns:
        What was asked for, and the options of all nodes.
    """
    parser = argparse.ArgumentParser(
        prog='ros2 run arm_bringup motion_demo',
        description='Bring a simulated arm up and move it: a square with the tool in the base '
        'frame and in its own, into the straight arm and back, a trajectory with a speed override '
        'in its middle, and one that is canceled. Ends with what was measured.',
        epilog=robots_epilog(),
        allow_abbrev=False,
    )
    add_arguments(parser, default_bus=f'{SIMULATED_BUS}: vcan0 when it is there, else multicast')
    parser.add_argument(
        '--duration',
        metavar='S',
        type=seconds_from(0.0),
        help='repeat it until so many seconds are over, once at least (default: until Ctrl-C)',
    )
    return parse_with_ros(parser, argv)


def demo_files(robot: Robot, folder: Path, ros: RosOptions, groups: MovedGroups) -> Sequence[Path]:
    """Write the parameter files of the demo: the robot's own, and what the demo relies on.

    Args:
        robot: A robot with an SRDF and limits.
        folder: Where to.
        ros: Options of all nodes.
        groups: Its groups that are moved.
    """
    values = {
        controller_names(robot, groups)[groups.names[0]]: {
            'ros__parameters': {'state_publish_rate': RATE}
        },
        'servo_node': {
            'ros__parameters': {
                'moveit_servo': {
                    'command_in_type': 'speed_units',
                    'scale': {'linear': 1.0},  # cap [m/s]
                }
            }
        },
    }
    path = folder / 'demo.yaml'
    path.write_text(json.dumps(values), encoding='utf-8')
    # the later of two equal names wins; a pattern of an earlier file loses to any name
    return [*motion_files(robot, folder, ros, groups), namespaced_parameters(path, ros, folder)]


def build_model(robot: Robot, urdf: str, group: str) -> RobotModel:
    """Build the arm, for where its tool is.

    Args:
        robot: The robot.
        urdf: Its description.
        group: The group that is moved.

    Raises:
        ModelError: Its files do not make an arm.
    """
    return RobotModel(
        urdf,
        read_semantic(robot),
        load_limits(robot.limits),
        group,
        robot.tip_link or None,
    )


def run(arm: Session, groups: MovedGroups, duration: float | None) -> int:
    """Run the demo.

    Args:
        arm: The arm, prepared.
        groups: Its groups that are moved; the first shows what it can.
        duration: How long it is repeated in [s]; None until Ctrl-C.

    Returns:
        0, or 1 when something went wrong.

    Raises:
        ModelError: Its files do not make an arm, or it has no pose to start from.
    """
    from arm_canopen import load_bus

    model = build_model(arm.robot, arm.urdf, groups.arms[0])
    start = choose_start(model)
    period = load_bus(arm.robot.bus_config).master.sync_period
    controller = controller_names(arm.robot, groups)[groups.names[0]]
    limits = {name: each for name, each in joint_limits(arm.urdf).items() if name in arm.drives}
    if arm.start:
        sys.stdout.write(f'{arm.start}\n')
    title = f'{arm.robot.name}: {len(arm.drives)} simulated drives on {arm.bus}'

    return run_demo(
        arm.processes,
        view=MotionView(ArmView(title, limits)),
        figures=MotionFigures(),
        commands=commands(controller, arm.ros),
        make_scenario=lambda display: MotionScenario(
            display,
            list(limits),
            arm.mode_service,
            model=model,
            start=start,
            period=period,
            duration=duration,
        ),
        make_client=lambda given_up: MotionClient(
            given_up, model, controller, period, arm.ros.namespace
        ),
        endless=False,
    )


def commands(controller: str, ros: RosOptions) -> list[str]:
    """Return commands to try in a second terminal.

    Args:
        controller: Name of the trajectory controller.
        ros: Options of all nodes.
    """
    return [
        f'ros2 run arm_servo servo_keyboard_input{ros.hint}',
        f'ros2 topic echo {ros.resolve("servo_node/status")}',
        f'ros2 topic echo {ros.resolve(controller)}/controller_state',
    ]


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo until its end or Ctrl-C.

    Args:
        argv: Arguments without the program's name; None takes those of the process.

    Returns:
        0 when all went well, 1 when something did not, 2 when nothing was started.
    """
    arguments, ros = parse(sys.argv[1:] if argv is None else argv)
    try:
        robot = locate(arguments)
        if robot.lacking:
            raise RobotError(
                f'{robot.name} lacks {robot.lacking}: '
                f'ros2 run arm_bringup check {arguments.robot} reports all of it'
            )
        groups = moved_groups(robot)
        with session(
            arguments,
            ros,
            simulate=True,
            master=MOTION_NODE,
            master_parameters={'diagnostics_period': '0.2'},
            master_files=partial(demo_files, groups=groups),
        ) as arm:
            return run(arm, groups, arguments.duration)
    except (BringupError, SupervisorError, ArmError) as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR
