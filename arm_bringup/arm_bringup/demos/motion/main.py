# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""``ros2 run arm_bringup motion_demo``: a simulated arm is jogged and follows trajectories."""

from __future__ import annotations

from collections.abc import Sequence
import json
from pathlib import Path

from arm_model import ArmError, load_limits, RobotModel
from process_supervisor import namespaced_parameters, RosOptions

from ...description import read_semantic
from ...groups import MovedGroups
from ...motion import controller_names, motion_files
from ...robots import Robot
from ...stack import MOTION_NODE
from ..program import DemoArm, DemoProgram, DemoSetup
from ..scenario import PartsScenario
from .client import MotionClient
from .figures import MotionFigures
from .poses import choose_start
from .sequence import MotionSequence

RATE = 100.0
"""Rate of the controller's states in [Hz]."""


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


def set_up(demo: DemoArm) -> DemoSetup:
    """Choose where the arm begins; the first group shows what it can.

    Raises:
        ModelError: The files do not make an arm, or it has no pose to start from.
    """
    from arm_canopen import load_bus

    arm, groups = demo.session, demo.groups
    model = build_model(arm.robot, arm.urdf, groups.arms[0])
    start = choose_start(model)
    period = load_bus(arm.robot.bus_config).master.sync_period
    controller = controller_names(arm.robot, groups)[groups.names[0]]
    return DemoSetup(
        commands(controller, arm.ros),
        lambda display: PartsScenario(
            display,
            demo.limits,
            arm.mode_service,
            demo.duration,
            lambda client, enter, look: MotionSequence(client, model, start, period, enter, look),
        ),
        lambda given_up: MotionClient(given_up, model, controller, period, arm.ros.namespace),
        MotionFigures(),
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


DEMO = DemoProgram(
    name='motion_demo',
    description='Bring a simulated arm up and move it: a square with the tool in the base '
    'frame and in its own, into the straight arm and back, a trajectory with a speed override '
    'in its middle, and one that is canceled. Ends with what was measured.',
    duration='repeat it until so many seconds are over, once at least (default: until Ctrl-C)',
    master=MOTION_NODE,
    set_up=set_up,
    label='motion',
    files=demo_files,
    errors=(ArmError,),
)
