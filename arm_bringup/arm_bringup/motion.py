# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the nodes of arm_servo need to know of a robot; arm_servo itself is not needed here.

arm_servo is an optional companion: it brings kinematics and solvers, which the drives alone do not
need. Where it is built, and the robot has an SRDF and limits, the bring-up runs its master.
"""

from __future__ import annotations

from collections.abc import Sequence
import json
from pathlib import Path

from process_supervisor import (
    EVERY_NODE,
    Executable,
    FindExecutable,
    namespaced_parameters,
    parameters_by_node,
    RosOptions,
    StartError,
)

from .description import read_semantic
from .exceptions import RobotError
from .groups import joints_of_groups, MovedGroups
from .robots import Robot
from .stack import MASTER, MOTION_NODE

MAKE_MOVE = 'build arm_servo (make build) for trajectories and jogging'


def motion_files(
    robot: Robot, folder: Path, ros: RosOptions, groups: MovedGroups
) -> Sequence[Path]:
    """Write the parameter file for the nodes of arm_servo.

    Returns:
        The files to hand over.
    """
    values: dict[str, str | list[str]] = {
        'robot_description_semantic': read_semantic(robot),
        'joint_limits': str(robot.limits),
        'group': groups.names[0],
        'tip_link': robot.tip_link,
    }
    if others := groups.names[1:]:  # an empty list has no type in a parameter file
        values['other_groups'] = list(others)
    moveit_servo = {'frame_prefix': ros.frame_prefix}
    servos = {'servo_node': {'ros__parameters': {'moveit_servo': moveit_servo}}} | {
        f'{arm}_servo_node': {
            'ros__parameters': {'group': arm, 'tip_link': '', 'moveit_servo': moveit_servo}
        }
        for arm in groups.arms[1:]
    }
    path = folder / 'motion.yaml'  # JSON is YAML, whatever characters are in it
    path.write_text(
        json.dumps(
            {
                EVERY_NODE: {'ros__parameters': values},
                **{f'{EVERY_NODE}/{name}': values for name, values in servos.items()},
            }
        ),
        encoding='utf-8',
    )
    if not robot.controllers.is_file():
        return [path]
    return [path, namespaced_parameters(robot.controllers, ros, folder)]


def planning_files(
    robot: Robot, folder: Path, ros: RosOptions, groups: MovedGroups
) -> Sequence[Path]:
    """Write the parameter files of :func:`motion_files`, and that of move_group's controllers.

    Raises:
        RobotError: A group is not in the description, or a file cannot be read.
    """
    joints = joints_of_groups(robot, groups)
    names = controller_names(robot, groups)
    manager: dict[str, object] = {'controller_names': list(names.values())}
    manager |= {names[group]: {'joints': list(joints[group])} for group in groups.arms}
    manager |= {
        names[tool]: {'joints': list(joints[tool]), 'type': gripper_action(joints[tool])}
        for tool in groups.tools
    }
    own = {'moveit_simple_controller_manager': manager, 'frame_prefix': ros.frame_prefix}
    values = {'ros__parameters': own}
    path = folder / 'planning.yaml'
    path.write_text(json.dumps({f'{EVERY_NODE}/move_group': values}), encoding='utf-8')
    return [*motion_files(robot, folder, ros, groups), path]


def gripper_action(joints: Sequence[str]) -> str:
    """Return the action by which a gripper of so many joints is moved, by MoveIt's name of it."""
    return 'GripperCommand' if len(joints) == 1 else 'ParallelGripperCommand'


def controller_names(robot: Robot, groups: MovedGroups) -> dict[str, str]:
    """Return the name of each group's controller; controllers.yaml may name that of the first.

    Raises:
        RobotError: A file cannot be read as what it should be.
    """
    try:
        table = parameters_by_node(robot.controllers) if robot.controllers.is_file() else {}
    except StartError as error:
        raise RobotError(f'{robot.folder}: {error}') from error
    manager = table.get('controller_manager', {}).get('ros__parameters', {})
    names = {group: f'{group}_controller' for group in groups.names}
    main = groups.names[0]
    return names | {main: str(manager.get('controller_name') or names[main])}


def choose_master(robot: Robot, find: FindExecutable) -> tuple[Executable, str]:
    """Choose what runs the bus.

    Returns:
        The executable, and in words why it offers no motion; empty when it does.
    """
    if find(MOTION_NODE.package, MOTION_NODE.name) is None:
        return MASTER, MAKE_MOVE
    if robot.lacking:
        return MASTER, f'{robot.name} lacks {robot.lacking} for trajectories and jogging'
    return MOTION_NODE, ''
