# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup demo``: a simulated arm boots, enables and waves."""

from __future__ import annotations

import argparse
from collections.abc import Callable, Collection, Sequence
from functools import partial
import itertools
import os
import sys

from demo_runner import REFRESH_PERIOD, run_demo
from process_supervisor import (
    parse_with_ros,
    RosOptions,
    SupervisorError,
    USAGE_ERROR,
)
from process_supervisor.arguments import seconds_from

from ...description import joint_limits
from ...exceptions import BringupError
from ...groups import joints_of_groups, moved_groups, MovedGroups
from ...robots import Robot
from ...session import add_arguments, robots_epilog, Session, session, SIMULATED_BUS
from ...stack import MASTER
from ..figures import Figures
from ..table import ArmView
from .plan import plan_wave, WaveStyle
from .scenario import Client, WaveScenario
from .wave import Wave


def parse(argv: Sequence[str]) -> tuple[argparse.Namespace, RosOptions]:
    """Parse the command line.

    Args:
        argv: Arguments without the program's name.

    Returns:
        What was asked for, and the options of all nodes.
    """
    parser = argparse.ArgumentParser(
        prog='ros2 run arm_bringup demo',
        description='Bring a simulated arm up, enable all its drives and let it wave. In a '
        'terminal a live table shows what it does; elsewhere a line every few seconds. Ctrl-C '
        'stops the wave, disables the drives and ends everything.',
        epilog=robots_epilog(),
        allow_abbrev=False,
    )
    add_arguments(parser, default_bus=f'{SIMULATED_BUS}: vcan0 when it is there, else multicast')
    parser.add_argument(
        '--duration',
        metavar='S',
        type=seconds_from(0.0),
        help='end after so many seconds of wave, with a summary; the exit code says whether all '
        'joints were enabled, moved (it takes them 5 s to get going) and followed (default: until '
        'Ctrl-C)',
    )
    return parse_with_ros(parser, argv)


def join_ros(wave: Wave, namespace: str, given_up: Callable[[], bool]) -> Client:
    """Make the ROS client of the demo; rclpy loads while the processes start.

    Args:
        wave: The wave.
        namespace: That of the arm.
        given_up: True when nothing shall be waited for any more.
    """
    from .client import WaveClient

    return WaveClient(given_up, wave, namespace)


def commands(joint: str, mode_service: str, candump: str, ros: RosOptions) -> list[str]:
    """Return commands to try in a second terminal.

    Args:
        joint: Name of a drive.
        mode_service: Service that selects the mode of the wave.
        candump: Command that shows the bus.
        ros: Options of all nodes.
    """
    call = 'ros2 service call'
    drive = ros.resolve(joint)
    return [
        f'{call} {drive}/position_mode std_srvs/srv/Trigger',
        f'{call} {drive}/target canopen_interfaces/srv/COTargetDouble "{{ target: 1.0 }}"',
        f'ros2 topic hz {ros.resolve("joint_states")}',
        candump,
        # back into the wave
        f'{call} {drive}/{mode_service} std_srvs/srv/Trigger',
        f'{call} {ros.resolve("wave/start")} std_srvs/srv/Trigger',
    ]


def waving_joints(robot: Robot, drives: Collection[str]) -> Collection[str]:
    """Return the joints that wave: those of the groups that are asked for, else all with a drive.

    Args:
        robot: The robot.
        drives: Names of its drives.

    Raises:
        RobotError: There is no such group.
    """
    if not robot.groups:
        return drives
    joints = joints_of_groups(robot, MovedGroups(moved_groups(robot).arms))
    return list(itertools.chain(*joints.values()))


def run(arm: Session, duration: float | None) -> int:
    """Run the demo.

    Args:
        arm: The arm, prepared.
        duration: How long the wave runs in [s]; None until Ctrl-C.

    Returns:
        0, or 1 when something went wrong.

    Raises:
        WaveError: No joint has a drive, or one cannot swing.
    """
    for name in sorted(set(arm.drives) - set(joint_limits(arm.urdf))):
        sys.stdout.write(
            f'warning: no joint of the description is called {name!r}; its drive stands still\n'
        )
    if arm.start:
        sys.stdout.write(f'{arm.start}\n')
    bus_config = os.path.relpath(arm.robot.bus_config)
    waving = waving_joints(arm.robot, arm.drives)
    view = ArmView(
        f'{arm.robot.name}: {len(arm.drives)} simulated drives on {arm.bus}',
        {name: limits for name, limits in joint_limits(arm.urdf).items() if name in arm.drives},
    )
    joints = {name: limits for name, limits in view.limits.items() if name in waving}
    style = WaveStyle()
    wave = Wave(plan_wave(joints, [name for name in arm.drives if name in joints], style), style)
    candump = f'ros2 run canopen_tools candump {arm.bus} --bus-config {bus_config}'
    return run_demo(
        arm.processes,
        view=view,
        figures=Figures(),
        commands=commands(arm.drives[0], arm.mode_service, candump, arm.ros),
        make_scenario=lambda display: WaveScenario(display, joints, arm.mode_service, duration),
        make_client=partial(join_ros, wave, arm.ros.namespace),
        endless=duration is None,
    )


def main(argv: Sequence[str] | None = None) -> int:
    """Run the demo until its end or Ctrl-C.

    Args:
        argv: Arguments without the program's name; None takes those of the process.

    Returns:
        0 when all went well, 1 when something did not, 2 when nothing was started.
    """
    arguments, ros = parse(sys.argv[1:] if argv is None else argv)
    parameters = {'diagnostics_period': f'{REFRESH_PERIOD}'}
    try:
        with session(
            arguments, ros, simulate=True, master=MASTER, master_parameters=parameters
        ) as arm:
            return run(arm, arguments.duration)
    except (BringupError, SupervisorError) as error:
        sys.stderr.write(f'{error}\n')
        return USAGE_ERROR
