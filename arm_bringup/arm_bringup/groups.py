# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Moving groups of an SRDF, parameter files of their nodes, and start positions of their drives.

arm_servo is an optional dependency, which this module does not import: it brings kinematics and
solvers that the drives alone do not need.

Real arms have absolute encoders and power up anywhere in their ranges. Simulated drives start at
0, unless a joint limit or a collision there would prevent motion.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
import json
from pathlib import Path
from typing import TYPE_CHECKING

import urdf_reader
from urdf_reader import find_group, KinematicTree, parse_srdf, read_urdf, SemanticDescription

from process_supervisor import (
    EVERY_NODE,
    namespaced_parameters,
    parameters_by_node,
    RosOptions,
    StartError,
)

from .robots import (
    BringupError,
    DescriptionError,
    joint_limits,
    read_bus,
    read_description,
    read_semantic,
    Robot,
    RobotError,
    SETTINGS,
    START_POSITIONS,
)

if TYPE_CHECKING:
    from arm_model import Array, RobotModel


@dataclass(frozen=True, slots=True)
class MovedGroups:
    """The moving groups of a robot, which share no joints."""

    arms: tuple[str, ...]
    """Groups that can jog and follow trajectories; the first is the main one."""
    tools: tuple[str, ...] = ()  # groups of end effectors
    joints: Mapping[str, Sequence[str]] = field(default_factory=dict, compare=False)
    """Joints of each group, by group name."""

    @property
    def names(self) -> tuple[str, ...]:
        """Names of all groups, arms first."""
        return (*self.arms, *self.tools)


def moved_groups(robot: Robot) -> MovedGroups:
    """Choose the moving groups of a robot folder; see :func:`choose_groups`.

    Raises:
        RobotError: A file cannot be read, or a group does not exist.
    """
    drives = read_bus(robot).joints
    try:
        semantic = parse_srdf(read_semantic(robot))
        return choose_groups(robot, semantic, read_urdf(read_description(robot)), drives)
    except (DescriptionError, urdf_reader.DescriptionError) as error:
        raise RobotError(f'{robot.folder}: {error}') from error


def choose_groups(
    robot: Robot, semantic: SemanticDescription, tree: KinematicTree, drives: Collection[str]
) -> MovedGroups:
    """Choose the groups to move.

    Arms are the groups that the robot folder names; else all SRDF groups that have drives, are
    neither end effectors nor composed of groups, and share no joint with an earlier group. Tools
    are the end effectors that have drives.

    Raises:
        RobotError: A group does not exist, no group has drives, or two groups share a joint.
    """
    known = ', '.join(semantic.groups) or 'none'
    hint = f'groups: {known}. Choose with group in {SETTINGS}, or --group NAME'
    if lost := [name for name in robot.groups if name not in semantic.groups]:
        raise RobotError(f'{robot.semantic.name} has no group {", ".join(lost)}; {hint}')
    joints = {name: _joints(name, semantic, tree) for name in semantic.groups}
    for name in robot.groups:
        try:
            find_group(tree, semantic, name)
        except urdf_reader.DescriptionError as error:
            raise RobotError(f'{robot.semantic.name}: {error}; {hint}') from error
        if idle := [joint for joint in joints[name] if joint not in drives]:
            raise RobotError(f'bus.yml has no drive for {", ".join(idle)} of group {name}; {hint}')
    driven = [name for name, each in joints.items() if each and set(each) <= set(drives)]
    own = _arms_named_as_tools(semantic, tree, joints)
    candidates = [name for name in driven if name in semantic.arms or name in own]
    arms = robot.groups or _disjoint(candidates, joints)
    arms = arms or tuple(driven[:1])
    if not arms:
        raise RobotError(f'no group of {robot.semantic.name} has a drive for each joint; {hint}')
    tools = [name for name in semantic.tools if name in driven and name not in own]
    chosen = _disjoint([*arms, *tools], joints)
    if shared := [name for name in arms if name not in chosen]:
        raise RobotError(f'group {shared[0]} shares joints with {chosen[0]}; {hint}')
    return MovedGroups(arms, chosen[len(arms) :], {name: joints[name] for name in chosen})


def _arms_named_as_tools(
    semantic: SemanticDescription, tree: KinematicTree, joints: Mapping[str, Sequence[str]]
) -> set[str]:
    """Return end effector groups that move their own parent link, and so are really arms.

    SRDFs made for planners other than MoveIt declare arms this way.
    """
    return {
        each.group
        for each in semantic.end_effectors
        if each.parent_link in tree.links
        and not {joint.name for joint in tree.chain(tree.root, each.parent_link)}.isdisjoint(
            joints.get(each.group, ())
        )
    }


def _joints(name: str, semantic: SemanticDescription, tree: KinematicTree) -> Sequence[str]:
    """Return the joints of a group; empty if the group cannot be moved."""
    try:
        return find_group(tree, semantic, name).joints
    except urdf_reader.DescriptionError:
        return ()


def _disjoint(names: Sequence[str], joints: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Return the groups that share no joint with an earlier group."""
    taken: set[str] = set()
    found = []
    for name in names:
        if taken.isdisjoint(joints[name]):
            taken.update(joints[name])
            found.append(name)
    return tuple(found)


def motion_files(
    robot: Robot, folder: Path, ros: RosOptions, groups: MovedGroups
) -> Sequence[Path]:
    """Write the parameter files for the nodes of arm_servo."""
    values: dict[str, str | list[str]] = {
        'robot_description_semantic': read_semantic(robot),
        'joint_limits': str(robot.limits),
        'group': groups.names[0],
        'tip_link': robot.tip_link,
    }
    if others := groups.names[1:]:  # an empty list has no type in a parameter file
        values['other_groups'] = list(others)
    servo = {'moveit_servo': {'frame_prefix': ros.frame_prefix}}
    nodes: dict[str, Mapping[str, object]] = {'': values, '/servo_node': servo}
    nodes |= {
        f'/{arm}_servo_node': {'group': arm, 'tip_link': '', **servo} for arm in groups.arms[1:]
    }
    path = _write(folder / 'motion.yaml', nodes)
    if not robot.controllers.is_file():
        return [path]
    return [path, namespaced_parameters(robot.controllers, ros, folder)]


def planning_files(
    robot: Robot, folder: Path, ros: RosOptions, groups: MovedGroups
) -> Sequence[Path]:
    """Write the parameter files of :func:`motion_files`, and that of move_group's controllers."""
    joints = groups.joints
    names = controller_names(robot, groups)
    manager: dict[str, object] = {'controller_names': list(names.values())}
    manager |= {names[group]: {'joints': list(joints[group])} for group in groups.arms}
    manager |= {
        names[tool]: {'joints': list(joints[tool]), 'type': gripper_action(joints[tool])}
        for tool in groups.tools
    }
    own = {'moveit_simple_controller_manager': manager, 'frame_prefix': ros.frame_prefix}
    path = _write(folder / 'planning.yaml', {'/move_group': own})
    return [*motion_files(robot, folder, ros, groups), path]


def _write(path: Path, nodes: Mapping[str, Mapping[str, object]]) -> Path:
    """Write parameters by node name suffix, as JSON, which is valid YAML for any characters."""
    table = {EVERY_NODE + name: {'ros__parameters': values} for name, values in nodes.items()}
    path.write_text(json.dumps(table), encoding='utf-8')
    return path


def gripper_action(joints: Sequence[str]) -> str:
    """Return MoveIt's name of the action for a gripper with these joints."""
    return 'GripperCommand' if len(joints) == 1 else 'ParallelGripperCommand'


def controller_names(robot: Robot, groups: MovedGroups) -> dict[str, str]:
    """Return each group's controller name; controllers.yaml may set that of the first group."""
    try:
        table = parameters_by_node(robot.controllers) if robot.controllers.is_file() else {}
    except StartError as error:
        raise RobotError(f'{robot.folder}: {error}') from error
    manager = table.get('controller_manager', {}).get('ros__parameters', {})
    names = {group: f'{group}_controller' for group in groups.names}
    main = groups.names[0]
    return names | {main: str(manager.get('controller_name') or names[main])}


@dataclass(frozen=True, slots=True)
class StartPositions:
    """Positions of simulated drives at power-on."""

    positions: Mapping[str, float] = field(default_factory=dict)
    """Positions that are not 0, by joint, in [rad or m]."""
    reason: str = ''  # why they are not 0, as text

    def __str__(self) -> str:
        """Return one line for the log; empty if all positions are 0."""
        places = ', '.join(f'{name} {place:g}' for name, place in self.positions.items() if place)
        return f'simulated drives start at {places}, because {self.reason}' if places else ''


def start_positions(robot: Robot, urdf: str, drives: Sequence[str]) -> StartPositions:
    """Choose the positions of a robot's simulated drives at power-on.

    Positions in robot.yaml apply. Otherwise a group that cannot be at 0 starts in its start pose,
    and any other drive that cannot be at 0 in the middle of its range.

    Raises:
        RobotError: robot.yaml names an unknown drive, or no pose is found.
    """
    if robot.start_positions:
        return StartPositions(given_positions(robot, drives), f'{SETTINGS} has {START_POSITIONS}')
    ranges = {name: each for name, each in joint_limits(urdf).items() if name in drives}
    positions: dict[str, float] = {}
    reasons: list[str] = []
    for model in _models(robot, urdf):
        if reason := _trouble_at_zero(model):
            positions |= _start(model)
            reasons.append(reason)
        for name in model.joints:
            ranges.pop(name, None)
    for name, each in ranges.items():
        if reason := _outside(name, each.lower, each.upper):
            positions[name] = 0.5 * (each.lower + each.upper)
            reasons.append(reason)
    return StartPositions(positions, f'at 0 {"; ".join(reasons)}' if reasons else '')


def given_positions(robot: Robot, drives: Sequence[str]) -> Mapping[str, float]:
    """Return the start positions from robot.yaml, by drive in [rad or m].

    Raises:
        RobotError: robot.yaml names an unknown drive, or a pose that the SRDF lacks.
    """
    given = robot.start_positions
    if isinstance(given, str):
        return {name: at for name, at in _pose(robot, given).items() if name in drives}
    if unknown := [name for name in given if name not in drives]:
        raise RobotError(
            f'{robot.folder / SETTINGS}: {START_POSITIONS}: bus.yml has no drive '
            f'{", ".join(unknown)}; drives: {", ".join(drives)}'
        )
    return given


def _pose(robot: Robot, name: str) -> Mapping[str, float]:
    """Return a named SRDF pose, merged from all groups that define it."""
    key = f'{robot.folder / SETTINGS}: {START_POSITIONS}'
    if not robot.semantic.is_file():
        raise RobotError(f'{key}: {name!r} is a pose of the SRDF, and there is none')
    try:
        poses = parse_srdf(read_semantic(robot)).poses.values()
    except (DescriptionError, urdf_reader.DescriptionError) as error:
        raise RobotError(f'{robot.folder}: {error}') from error
    if not any(name in each for each in poses):
        known = ', '.join(dict.fromkeys(pose for each in poses for pose in each)) or 'none'
        raise RobotError(f'{key}: the SRDF has no pose {name!r}; poses: {known}')
    return {joint: at for each in poses for joint, at in each.get(name, {}).items()}


def _models(robot: Robot, urdf: str) -> list[RobotModel]:
    """Return the models of the moving groups; empty if nothing can move them."""
    if robot.lacking:
        return []
    try:
        from arm_model import ArmError, load_limits, RobotModel
    except ImportError:
        return []
    try:
        semantic, limits = read_semantic(robot), load_limits(robot.limits)
        groups = moved_groups(robot).names
        return [RobotModel(urdf, semantic, limits, group) for group in groups]
    except (ArmError, BringupError):
        return []  # the program that moves them reports it


def _trouble_at_zero(model: RobotModel) -> str:
    """Return why a group cannot be at 0; empty if it can."""
    import numpy as np

    zero = np.zeros(len(model))
    for name, lower, upper in zip(
        model.joints, model.limits.lower, model.limits.upper, strict=True
    ):
        if reason := _outside(name, lower, upper):
            return reason
    nearest = model.nearest(zero, 0.0, 1)
    return ' and '.join(nearest[0].links) + ' collide' if nearest else ''


def _outside(name: str, lower: float, upper: float) -> str:
    if lower <= 0.0 <= upper:
        return ''
    return f'{name} is outside its range of {lower:g} to {upper:g}'


def _start(model: RobotModel) -> dict[str, float]:
    from arm_model import ModelError, start_pose

    try:
        start: Array = start_pose(model)
    except ModelError as error:
        raise RobotError(
            f'{error}; or say where the simulated drives start: {START_POSITIONS} in {SETTINGS}'
        ) from error
    return {name: float(place) for name, place in zip(model.joints, start, strict=True)}
