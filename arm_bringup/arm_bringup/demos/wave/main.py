# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup demo``: a simulated arm boots, enables and waves."""

from __future__ import annotations

from collections.abc import Callable, Collection
from functools import partial
import itertools
import os
import sys

from process_supervisor import RosOptions

from ...description import joint_limits
from ...groups import joints_of_groups, moved_groups, MovedGroups
from ...robots import Robot
from ...stack import MASTER
from ..figures import Figures
from ..program import DemoArm, DemoProgram, DemoSetup
from .plan import plan_wave, WaveStyle
from .scenario import Client, WaveScenario
from .wave import Wave


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


def set_up(demo: DemoArm) -> DemoSetup:
    """Plan the wave.

    Raises:
        WaveError: No joint has a drive, or one cannot swing.
    """
    arm = demo.session
    for name in sorted(set(arm.drives) - set(joint_limits(arm.urdf))):
        sys.stdout.write(
            f'warning: no joint of the description is called {name!r}; its drive stands still\n'
        )
    waving, style = waving_joints(arm.robot, arm.drives), WaveStyle()
    joints = {name: limits for name, limits in demo.limits.items() if name in waving}
    wave = Wave(plan_wave(joints, [name for name in arm.drives if name in joints], style), style)
    bus_config = os.path.relpath(arm.robot.bus_config)
    candump = f'ros2 run canopen_tools candump {arm.bus} --bus-config {bus_config}'
    return DemoSetup(
        commands(arm.drives[0], arm.mode_service, candump, arm.ros),
        lambda display: WaveScenario(display, joints, arm.mode_service, demo.duration),
        partial(join_ros, wave, arm.ros.namespace),
        Figures(),
    )


DEMO = DemoProgram(
    name='demo',
    description='Bring a simulated arm up, enable all its drives and let it wave. In a '
    'terminal a live table shows what it does; elsewhere a line every few seconds. Ctrl-C '
    'stops the wave, disables the drives and ends everything.',
    duration='end after so many seconds of wave, with a summary; the exit code says whether all '
    'joints were enabled, moved (it takes them 5 s to get going) and followed (default: until '
    'Ctrl-C)',
    master=MASTER,
    set_up=set_up,
    endless=True,
)
main = DEMO.main  # the entry point
