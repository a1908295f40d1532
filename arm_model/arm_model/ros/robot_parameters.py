# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The arm from ROS parameters, under MoveIt's names."""

from __future__ import annotations

from pathlib import Path

from rclpy.node import Node

from node_runner import ParameterReader

from ..exceptions import ModelError
from ..limits import load_limits
from ..model import RobotModel


def declare_robot(node: Node) -> RobotModel:
    """Declare what describes an arm, and build it.

    Args:
        node: The node.

    Raises:
        ModelError: A parameter is missing, or they do not make an arm.
    """
    urdf, srdf, limits, group, tip = _declare(node)
    for name, value in (
        ('robot_description', urdf),
        ('robot_description_semantic', srdf),
        ('joint_limits', limits),
    ):
        if not value:
            raise ModelError(f'no {name}: give it with --ros-args -p {name}:=... or a params file')
    return RobotModel(urdf, srdf, load_limits(Path(limits)), group or None, tip or None)


def same_robot(node: Node, model: RobotModel) -> None:
    """Declare what describes an arm on a further node, where clients ask for it too.

    Args:
        node: The node.
        model: The arm.

    Raises:
        ModelError: The node is given another group or tip.
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
