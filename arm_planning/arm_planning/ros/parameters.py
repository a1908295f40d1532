# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Parameters of move_group, from its node and from a package, and the controllers they name."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
import re
from typing import Any

from control_msgs.action import FollowJointTrajectory, GripperCommand, ParallelGripperCommand
from rclpy.node import Node
from trajectory_msgs.msg import JointTrajectory
from urdf_reader import read_urdf

from arm_model import LimitsError, merge_limits
from arm_model.ros import declare_description, Description
from node_runner import (
    declare_given,
    give_defaults,
    given_values,
    ParameterError,
    ParameterReader,
    refuse_misspelt,
)

from ..exceptions import ConfigError
from ..moveit_package import MoveItPackage, Place
from ..moveit_settings import (
    at,
    known_of,
    LIMITS,
    MANAGER,
    MoveItSettings,
    read_settings,
    WITHOUT_EFFECT,
)
from ..pilz_motions import CartesianLimits
from .robot_groups import RobotGroups


@dataclass(frozen=True, slots=True)
class ControllerKind:
    """Action type of a controller."""

    name: str  # MoveIt's name of it
    action: Any  # class of its action
    namespace: str  # name of its action below that of the controller, by default
    # makes a goal of the part of a trajectory that is for its joints
    goal: Callable[[JointTrajectory], Any]
    single: bool = False  # whether it moves one joint only


@dataclass(frozen=True, slots=True)
class Controller:
    """A controller."""

    joints: Sequence[str]  # joints that it moves
    kind: ControllerKind  # what it takes
    namespace: str  # name of its action below that of the controller
    max_effort: float = 0.0  # greatest effort of a GripperCommand in [N]; 0 for its own

    def goal(self, part: JointTrajectory) -> Any:  # noqa: ANN401  # messages have no type
        """Return the action goal for the part of a trajectory that moves its joints."""
        goal = self.kind.goal(part)
        if self.kind.single and self.max_effort:
            goal.command.max_effort = self.max_effort
        return goal

    def action(self, name: str) -> str:
        """Return the name of its action, derived from its own name."""
        return f'{name}/{self.namespace}'


def _grip(part: JointTrajectory) -> Any:  # noqa: ANN401  # messages have no type
    """Return the end of the trajectory; the gripper plans its own motion."""
    goal = GripperCommand.Goal()
    (goal.command.position,) = part.points[-1].positions
    return goal


def _grip_in_parallel(part: JointTrajectory) -> Any:  # noqa: ANN401
    goal = ParallelGripperCommand.Goal()
    goal.command.name = list(part.joint_names)
    goal.command.position = list(part.points[-1].positions)
    return goal


FOLLOW = ControllerKind(
    'FollowJointTrajectory',
    FollowJointTrajectory,
    'follow_joint_trajectory',
    lambda part: FollowJointTrajectory.Goal(trajectory=part),
)
KINDS = {
    each.name: each
    for each in (
        FOLLOW,
        ControllerKind('GripperCommand', GripperCommand, 'gripper_cmd', _grip, single=True),
        ControllerKind(
            'ParallelGripperCommand',
            ParallelGripperCommand,
            'parallel_gripper_cmd',
            _grip_in_parallel,
        ),
    )
}
"""Kinds of controllers by MoveIt's names."""


@dataclass(frozen=True, slots=True)
class ExecutionLimits:
    """Limits that refuse or stop an execution; MoveIt's parameters ``trajectory_execution.*``."""

    # how far the robot may be from the start in [rad]; 0 for anywhere
    start_tolerance: float = 0.01
    duration_scaling: float = 1.1  # how many times as long as planned it may take
    duration_margin: float = 0.5  # how much longer than that in [s]
    is_monitored: bool = True  # whether one that takes longer is stopped
    is_allowed: bool = True  # whether anything is executed


OMPL_CONFIG = r'^(ompl\.planner_configs\.)[^.]+\.'  # before a key of a planner configuration


@dataclass(frozen=True, slots=True)
class MoveGroupParameters:
    """Parameters of move_group."""

    description: Description  # what describes the robot
    settings: MoveItSettings  # what parameters of MoveIt's names say
    cartesian_limits: CartesianLimits  # limits of LIN and CIRC
    places: Mapping[str, Place]  # where parameters come from, of those that come from a file
    names: Sequence[str]  # names of all that were given, less those of sensors


def declare_parameters(node: Node, package: MoveItPackage | None = None) -> MoveGroupParameters:
    """Declare the parameters that describe the robot, and read those of the planners."""
    given = given_values(node)
    places: dict[str, Place] = {}
    if package is not None:
        places = {name: place for name, place in package.places.items() if name not in given}
        give_defaults(node, package.parameters)
        given = {**package.parameters, **given}
    if not given.get('robot_description'):
        raise ConfigError(
            'no robot_description: start move_group with --moveit-config DIR, have `ros2 run'
            ' arm_bringup bringup ROBOT --plan` start it, or give the parameter in a params file'
        )
    settings = read_settings(given, places)
    limits = settings.joint_limits
    if limits is None and package is not None:
        limits = {}
    description = declare_description(node, limits)
    if limits is not None and not node.get_parameter('joint_limits').value:
        table = _complete(node, description.urdf, limits, places)
        description = replace(description, limits=table)
    return MoveGroupParameters(
        description,
        settings,
        CartesianLimits.of_table(settings.cartesian_limits),
        places,
        [name for name in given if name.partition('.')[0] not in settings.sensors],
    )


def declare_others(node: Node, names: Sequence[str]) -> None:
    """Declare the remaining overrides, so that tools list them, and log them once."""
    read = [name for name in names if known_of(name) is not None]
    declare_given(node, read, "MoveIt's, read at the start")
    in_tables = {name for name in names if '.' in name}  # keys of tables are looked at by name
    unused = sorted(set(names).intersection(refuse_misspelt(node, in_tables | WITHOUT_EFFECT)))
    declare_given(node, unused, 'without effect here')
    if unused:
        shown = dict.fromkeys(re.sub(OMPL_CONFIG, r'\1*.', name) for name in unused)
        node.get_logger().info(f'parameters without effect here: {", ".join(shown)}')


def _complete(
    node: Node, urdf: str, limits: Mapping[str, Mapping[str, object]], places: Mapping[str, Place]
) -> Mapping[str, Mapping[str, object]]:
    """Return limits of all joints; joints without a table get those of the URDF."""
    tree = read_urdf(urdf)
    joints = [joint.name for joint in tree.movable() if joint.independent]
    table = {name: limits.get(name, {}) for name in joints}
    notes: list[str] = []
    for name in joints:
        try:
            merge_limits([name], tree, table, notes)
        except LimitsError as error:  # noqa: PERF203
            raise ConfigError(f'{at(f"{LIMITS}.{name}", places)}: {error}') from error
    by_default: dict[str, list[str]] = {}
    for note in notes:
        words, _, name = note.rpartition(': ')
        by_default.setdefault(words, []).append(name)
    for words, names in by_default.items():
        node.get_logger().info(f'joint limits: {words}: {", ".join(names)}')
    return table


def declare_execution_limits(node: Node) -> ExecutionLimits:
    """Declare ``trajectory_execution.*``."""
    read = ParameterReader(node, 'trajectory_execution.')
    return ExecutionLimits(
        read.number(
            'allowed_start_tolerance',
            0.01,
            (0.0, 10.0),
            'how far the robot may be from the start of a trajectory; 0 is anywhere [rad]',
        ),
        read.number(
            'allowed_execution_duration_scaling',
            1.1,
            (1.0, 100.0),
            'how many times as long as planned a trajectory may take',
        ),
        read.number(
            'allowed_goal_duration_margin',
            0.5,
            (0.0, 100.0),
            'how much longer than that it may take [s]',
        ),
        read.flag(
            'execution_duration_monitoring',
            'whether a trajectory that takes longer is stopped',
            default=True,
        ),
        ParameterReader(node).flag(
            'allow_trajectory_execution', 'whether trajectories are executed', default=True
        ),
    )


def declare_controllers(
    node: Node, robot: RobotGroups, places: Mapping[str, Place]
) -> dict[str, Controller]:
    """Declare the controllers; by default those of bring-up, one for each group.

    Controllers marked ``default`` come first: they get joints that several can move.
    """
    defaults = {f'{group}_controller': list(each) for group, each in robot.group_joints().items()}
    names = ParameterReader(node, f'{MANAGER}.').texts(
        'controller_names', list(defaults), 'controllers that follow trajectories'
    )
    found, first = {}, []
    for name in names:
        read = ParameterReader(node, f'{MANAGER}.{name}.')
        joints = read.texts('joints', defaults.get(name, []), f'joints that {name} moves')
        if not joints:
            raise ConfigError(
                f'{at(f"{MANAGER}.controller_names", places)} has {name!r}, and'
                f' {MANAGER}.{name}.joints is missing; give its joints'
            )
        for joint in joints:
            if joint not in robot.all_joints:
                raise ConfigError(
                    f'{at(f"{MANAGER}.{name}.joints", places)} names {joint!r}, which the robot'
                    f' does not have; its joints: {", ".join(robot.all_joints)}'
                )
        found[name] = _controller(read, name, joints, robot, places)
        if read.flag('default', f'{name} comes before those that are not', default=False):
            first.append(name)
    return {name: found[name] for name in sorted(found, key=lambda name: name not in first)}


def _controller(
    read: ParameterReader,
    name: str,
    joints: list[str],
    robot: RobotGroups,
    places: Mapping[str, Place],
) -> Controller:
    kind = read.choice('type', FOLLOW.name, KINDS, f'what {name} takes')
    namespace = read.text('action_ns', kind.namespace, f'name of the action of {name}')
    effort = read.number('max_effort', 0.0, None, f'greatest effort of {name}; 0 for its own')
    # a joint that follows another one needs no command
    moved = [joint for joint in joints if joint in robot.joints]
    if kind.single:
        lead = read.text('command_joint', '', f'joint whose position {name} takes; empty: its one')
        moved = [lead] if lead else moved
        if len(moved) != 1 or lead not in {'', *joints}:
            raise ParameterError(
                f'{at(f"{MANAGER}.{name}.joints", places)} has {len(moved)} joints that follow no'
                f' other, and a {kind.name} moves one; give command_joint, one of them'
            )
    return Controller(tuple(moved), kind, namespace, effort)
