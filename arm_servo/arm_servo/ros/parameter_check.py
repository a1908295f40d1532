# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""What the nodes would refuse of a parameter file, without running them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, TYPE_CHECKING

from arm_model import ModelError, RobotModel

if TYPE_CHECKING:
    from rclpy.node import Node

EVERY_NODE = '/**'
"""Name in a parameter file that stands for all nodes."""


def check_parameters(model: RobotModel, document: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return what motion_node would refuse.

    They are asked themselves: the parameters are declared by the same functions, on nodes that
    are not there. This needs rclpy, and starts nothing.

    Args:
        model: The arm.
        document: A parameter file: nodes, ``ros__parameters``, parameters.

    Returns:
        Name of the node, and why it refuses: the first mistake of each.
    """
    from node_runner import ParameterError, refuse_misspelt

    from .parameter_sheet import ParameterSheet
    from .upstream_parameters import is_upstream

    problems = []
    for name, declare in _nodes(model, document).items():
        sheet = ParameterSheet(name, _given(document, name))
        try:
            declare(sheet.node)
            refuse_misspelt(sheet.node, is_upstream)
        except (ParameterError, ModelError) as error:
            problems.append((name, str(error)))
    return problems


def _nodes(model: RobotModel, document: Mapping[str, Any]) -> dict[str, Callable[[Node], object]]:
    """Return what declares the parameters of each node."""
    from arm_model.ros import same_robot
    from node_runner import ParameterReader

    from ..io.topic_output import ARRAY, declare_output, TRAJECTORY
    from .controller_manager import declare_manager
    from .joint_state_broadcaster import declare_broadcaster
    from .servo.parameters import declare_servo, PREFIX
    from .topics_backend import declare_loop
    from .trajectory.parameters import declare_check, declare_trajectory

    def manager(node: Node) -> None:
        same_robot(node, model)
        declare_manager(node, model)

    def controller(node: Node) -> None:
        declare_trajectory(node, model.joints)
        declare_loop(node, '')
        declare_output(node, '', '', ARRAY)

    def servo(node: Node) -> None:
        same_robot(node, model)
        declare_servo(node, model)
        declare_loop(node, PREFIX)
        declare_output(node, PREFIX, '', TRAJECTORY)
        declare_check(ParameterReader(node, PREFIX))

    named = _given(document, 'controller_manager').get('controller_name')
    return {
        'controller_manager': manager,
        str(named or f'{model.group}_controller'): controller,
        'servo_node': servo,
        'joint_state_broadcaster': declare_broadcaster,
    }


def _given(document: Mapping[str, Any], node: str) -> dict[str, Any]:
    """Return the parameters of a node; later ones of the file count more, as in rcl."""
    given: dict[str, Any] = {}
    names = {EVERY_NODE, node, f'/{node}', f'{EVERY_NODE}/{node}'}
    for name, table in document.items():
        if name in names and isinstance(table, dict):
            given |= table.get('ros__parameters') or {}
    return given
