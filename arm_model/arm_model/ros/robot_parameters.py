# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Builds the arm from ROS parameters with MoveIt's names."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

from rclpy.node import Node
from urdf_reader import find_group, parse_srdf, read_urdf

from node_runner import ParameterReader

from ..exceptions import description_refused, limits_refused, ModelError
from ..limits import load_limits
from ..model import RobotModel


@dataclass(frozen=True, slots=True)
class GroupModels:
    """Models of the groups of a robot that move independently."""

    arms: Sequence[RobotModel]  # arms; the first is that of the parameter ``group``
    tools: Sequence[RobotModel] = ()  # end effectors

    @property
    def notes(self) -> list[str]:
        """Notes on all groups without repetition, and without contacts of end effectors."""
        of_arms = [note for model in self.arms for note in model.notes]
        of_tools = [note for model in self.tools for note in model.notes_beside_contact]
        return list(dict.fromkeys((*of_arms, *of_tools)))


@dataclass(frozen=True, slots=True)
class Description:
    """URDF, SRDF and limits of a robot."""

    urdf: str  # robot description as XML text
    srdf: str  # semantic description as XML text
    limits: Mapping[str, Any]  # the table ``joint_limits`` of the limits file
    limits_file: str = ''  # that file; empty where there is none


def declare_description(node: Node, limits: Mapping[str, Any] | None = None) -> Description:
    """Declare the parameters that describe a robot, for a node that handles all groups.

    Args:
        limits: The table ``joint_limits`` to use without a limits file; None requires a file.

    Raises:
        ModelError: A parameter is missing, or the limits file cannot be read.
    """
    urdf, srdf, path, _group, _tip = _given(node, needs_limits=limits is None)
    return Description(urdf, srdf, load_limits(Path(path)) if path else limits or {}, path)


def declare_robot(node: Node) -> RobotModel:
    """Declare the parameters that describe an arm, and build it.

    Raises:
        ModelError: A parameter is missing, or the parameters do not define an arm.
    """
    urdf, srdf, limits, group, tip = _given(node)
    table = load_limits(Path(limits))
    with limits_refused(limits):
        return RobotModel(urdf, srdf, table, group or None, tip or None)


def declare_groups(node: Node) -> GroupModels:
    """Declare the parameters that describe a robot with several groups, and build their models.

    Raises:
        ModelError: A parameter is missing or invalid, or groups share a joint.
    """
    names = ParameterReader(node).texts(
        'other_groups', [], 'groups of the SRDF that are moved beside group, each by itself'
    )
    if not names:
        return GroupModels([declare_robot(node)])
    urdf, srdf, limits, group, tip = _given(node)
    with description_refused():
        semantic, tree = parse_srdf(srdf), read_urdf(urdf)
        joints = {name: find_group(tree, semantic, name).joints for name in (group, *names)}
    for first, second in combinations(joints, 2):
        if shared := set(joints[first]) & set(joints[second]):
            raise ModelError(f'groups {first} and {second} share the joint {min(shared)}')
    table = load_limits(Path(limits))
    arms = [name for name in joints if name == group or name not in semantic.tools]

    def arm(name: str) -> RobotModel:
        others = {other: joints[other] for other in arms if other != name}
        tip_link = tip if name == group else ''
        return RobotModel(urdf, srdf, table, name, tip_link or None, moved_by_others=others)

    with limits_refused(limits):
        tools = [RobotModel(urdf, srdf, table, name) for name in joints if name not in arms]
        return GroupModels([arm(name) for name in arms], tools)


def _given(node: Node, *, needs_limits: bool = True) -> tuple[str, str, str, str, str]:
    """Declare the parameters that describe an arm, and check that they are set."""
    urdf, srdf, limits, group, tip = _declare(node)
    for name, value in (
        ('robot_description', urdf),
        ('robot_description_semantic', srdf),
        ('joint_limits', limits),
    ):
        if not value and (needs_limits or name != 'joint_limits'):
            raise ModelError(f'no {name}: give it with --ros-args -p {name}:=... or a params file')
    with description_refused('robot_description'):
        read_urdf(urdf)
    with description_refused('robot_description_semantic'):
        parse_srdf(srdf)
    return urdf, srdf, limits, group, tip


def same_robot(node: Node, model: RobotModel) -> None:
    """Declare the same arm on a further node, where clients read its parameters as well.

    Raises:
        ModelError: The node was given another group or tip.
    """
    _urdf, _srdf, _limits, group, tip = _declare(node)
    if group not in {'', model.group} or tip not in {'', model.tip}:
        raise ModelError(
            f'{node.get_name()}: group {group!r} and tip_link {tip!r} are not those of the arm,'
            f' {model.group!r} and {model.tip!r}'
        )


def _declare(node: Node) -> tuple[str, str, str, str, str]:
    """Declare URDF, SRDF, limits file, group and tip."""
    read = ParameterReader(node)
    urdf = read.text('robot_description', '', 'URDF of the robot as XML text')
    srdf = read.text('robot_description_semantic', '', 'SRDF of the robot as XML text')
    limits = read.text(
        'joint_limits', '', "path of the limits file, in MoveIt's format of joint_limits.yaml"
    )
    group = read.text('group', '', 'group of the SRDF to move; empty takes its only one')
    tip = read.text('tip_link', '', "link that is moved; empty takes the group's end")
    return urdf, srdf, limits, group, tip
