# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the nodes refuse of their parameters, and what they would refuse of a file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TYPE_CHECKING

from arm_model import ModelError, RobotModel

if TYPE_CHECKING:
    from rclpy.node import Node

    from arm_model.ros import GroupModels

Declare = Callable[['Node'], object]  # declares the parameters of a node
EVERY_NODE = '/**'  # name in a parameter file that stands for all nodes


def check_parameters(models: GroupModels, document: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what motion_node would refuse.

    They are asked themselves: the parameters are declared by the same functions, on nodes that
    are not there. This needs rclpy, and starts nothing.

    Args:
        document: A parameter file: nodes, ``ros__parameters``, parameters.

    Returns:
        Name of the node, and why it refuses: the first mistake of each.
    """
    from node_runner import ParameterError, refuse_misspelt

    from .parameter_names import OF_OTHERS
    from .parameter_sheet import ParameterSheet

    problems = []
    for name, declare in _nodes(models, document).items():
        sheet = ParameterSheet(name, _given(document, name))
        try:
            declare(sheet.node)
            refuse_misspelt(sheet.node, OF_OTHERS)
        except (ParameterError, ModelError) as error:
            problems.append((name, str(error)))
    return problems


def _nodes(models: GroupModels, document: Mapping[str, Any]) -> dict[str, Declare]:
    """Return what declares the parameters of each node."""
    from arm_model.ros import same_robot
    from node_runner import ParameterReader

    from ..io.topic_output import ARRAY, declare_output, TRAJECTORY
    from .controller_manager import declare_manager
    from .gripper.parameters import declare_gripper
    from .joint_state_broadcaster import declare_broadcaster
    from .servo.parameters import declare_servo, PREFIX
    from .topics_backend import declare_loop
    from .trajectory.parameters import declare_check, declare_trajectory

    main, *others = models.arms

    def manager(node: Node) -> None:
        same_robot(node, main)
        declare_manager(node, main)

    def controller(model: RobotModel, node: Node, *, checks: bool = True) -> None:
        declare_trajectory(node, model.joints, model.limits if checks else None, checks=checks)
        declare_loop(node, '')
        declare_output(node, '', '', ARRAY)

    def tool(model: RobotModel, node: Node) -> None:
        controller(model, node, checks=False)
        declare_gripper(node)

    def servo(model: RobotModel, node: Node) -> None:
        same_robot(node, model)
        declare_servo(node, model)
        declare_loop(node, PREFIX)
        declare_output(node, PREFIX, '', TRAJECTORY)
        declare_check(ParameterReader(node, PREFIX))

    named = _given(document, 'controller_manager').get('controller_name')
    nodes: dict[str, Declare] = {
        'controller_manager': manager,
        str(named or f'{main.group}_controller'): partial(controller, main),
        'servo_node': partial(servo, main),
        'joint_state_broadcaster': declare_broadcaster,
    }
    for model in others:
        nodes[f'{model.group}_controller'] = partial(controller, model)
        nodes[f'{model.group}_servo_node'] = partial(servo, model)
    return nodes | {f'{model.group}_controller': partial(tool, model) for model in models.tools}


def _given(document: Mapping[str, Any], node: str) -> dict[str, Any]:
    """Return the parameters of a node; later ones of the file count more, as in rcl."""
    given: dict[str, Any] = {}
    names = {EVERY_NODE, node, f'/{node}', f'{EVERY_NODE}/{node}'}
    for name, table in document.items():
        if name in names and isinstance(table, dict):
            given |= table.get('ros__parameters') or {}
    return given
