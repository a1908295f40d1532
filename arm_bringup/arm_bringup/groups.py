# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Which groups of an SRDF are moved: arms, and the tools at their ends."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

import urdf_reader
from urdf_reader import find_group, KinematicTree, parse_srdf, read_urdf, SemanticDescription

from .bus import read_bus
from .description import read_description, read_semantic
from .exceptions import DescriptionError, RobotError
from .robots import Robot, SETTINGS


@dataclass(frozen=True, slots=True)
class MovedGroups:
    """The groups of a robot that are moved; no two have a joint in common.

    Attributes:
        arms: Groups that are jogged and follow trajectories; the first is the main one.
        tools: Groups of end effectors.
    """

    arms: tuple[str, ...]
    tools: tuple[str, ...] = ()

    @property
    def names(self) -> tuple[str, ...]:
        """All of them."""
        return (*self.arms, *self.tools)


def moved_groups(robot: Robot) -> MovedGroups:
    """Choose the groups of a robot folder that are moved; as :func:`choose_groups`.

    Raises:
        RobotError: A file cannot be read, or there is no such group.
    """
    drives = read_bus(robot).joints
    try:
        semantic = parse_srdf(read_semantic(robot))
        return choose_groups(robot, semantic, read_urdf(read_description(robot)), drives)
    except (DescriptionError, urdf_reader.DescriptionError) as error:
        raise RobotError(f'{robot.folder}: {error}') from error


def joints_of_groups(robot: Robot, groups: MovedGroups) -> dict[str, Sequence[str]]:
    """Return the joints of each group that is moved.

    Raises:
        RobotError: A group is not in the description, or a file cannot be read.
    """
    try:
        tree, semantic = read_urdf(read_description(robot)), parse_srdf(read_semantic(robot))
        return {name: find_group(tree, semantic, name).joints for name in groups.names}
    except (DescriptionError, urdf_reader.DescriptionError) as error:
        raise RobotError(f'{robot.folder}: {error}') from error


def choose_groups(
    robot: Robot, semantic: SemanticDescription, tree: KinematicTree, drives: Collection[str]
) -> MovedGroups:
    """Choose the groups that are moved.

    Arms are what the robot folder names; else all groups of the SRDF that have drives, are
    neither end effectors nor made of groups, and share no joint with a group before them. Tools
    are the end effectors that have drives.

    Raises:
        RobotError: The SRDF has no such group, none with drives, or two share a joint.
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
    return MovedGroups(arms, chosen[len(arms) :])


def _arms_named_as_tools(
    semantic: SemanticDescription, tree: KinematicTree, joints: Mapping[str, Sequence[str]]
) -> set[str]:
    """Return groups of end effectors that move the link which carries these: they are the arms.

    SRDFs of other planners than MoveIt name the arm there.
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
    """Return the joints of a group; none where it cannot be moved."""
    try:
        return find_group(tree, semantic, name).joints
    except urdf_reader.DescriptionError:
        return ()


def _disjoint(names: Sequence[str], joints: Mapping[str, Sequence[str]]) -> tuple[str, ...]:
    """Return the groups that share no joint with one before them."""
    taken: set[str] = set()
    found = []
    for name in names:
        if taken.isdisjoint(joints[name]):
            taken.update(joints[name])
            found.append(name)
    return tuple(found)
