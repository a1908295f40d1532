# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""Offline check of a parameter file, as the nodes would check it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import SimpleNamespace
from typing import Any, cast, TYPE_CHECKING

from arm_model import ModelError, RobotModel

if TYPE_CHECKING:
    from rclpy.node import Node

    from arm_model.ros import GroupModels

Declare = Callable[['Node'], object]  # declares the parameters of a node
EVERY_NODE = '/**'  # name in a parameter file that stands for all nodes


def check_parameters(models: GroupModels, document: Mapping[str, Any]) -> list[tuple[str, str]]:
    """Return the errors that motion_node would report for a parameter file.

    The nodes' own functions declare the parameters, on stand-ins instead of nodes. This needs
    rclpy, but starts no node.

    Args:
        document: A parameter file: nodes, ``ros__parameters``, parameters.

    Returns:
        For each node with errors, its name and the first error.
    """
    from node_runner import ParameterError, refuse_misspelt

    from .group_motion import OF_OTHERS

    problems = []
    for name, declare in _nodes(models, document).items():
        sheet = ParameterSheet(name, _given(document, name))
        try:
            node = cast('Node', sheet)
            declare(node)
            refuse_misspelt(node, OF_OTHERS)
        except (ParameterError, ModelError) as error:
            problems.append((name, str(error)))
    return problems


def _nodes(models: GroupModels, document: Mapping[str, Any]) -> dict[str, Declare]:
    """Return the function that declares the parameters of each node, by node name."""
    from arm_model.ros import same_robot
    from node_runner import ParameterReader

    from .controller_manager import declare_broadcaster, declare_manager
    from .gripper import GripperParameters
    from .servo_commands import declare_servo, PREFIX
    from .topics_backend import ARRAY, declare_loop, declare_output, TRAJECTORY
    from .trajectory_goals import declare_check, declare_trajectory

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
        ParameterReader(node).settings(GripperParameters)

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
    """Return the parameters of a node; later entries of the file win, as in rcl."""
    given: dict[str, Any] = {}
    names = {EVERY_NODE, node, f'/{node}', f'{EVERY_NODE}/{node}'}
    for name, table in document.items():
        if name in names and isinstance(table, dict):
            given |= table.get('ros__parameters') or {}
    return given


class ParameterSheet:
    """Stand-in for a node, with the parameter interface; filled from a parameter file."""

    def __init__(self, name: str, table: Mapping[str, Any]) -> None:
        self._name = name
        self._parameter_overrides = {
            key: SimpleNamespace(name=key, value=value) for key, value in flat(table).items()
        }
        self._declared: dict[str, Any] = {}

    def get_name(self) -> str:
        """Return the name of the node."""
        return self._name

    def declare_parameter(
        self, name: str, value: object, *_descriptor: object, **_: object
    ) -> SimpleNamespace:
        """Declare a parameter, and return it."""
        self._declared[name] = SimpleNamespace(name=name, value=value)
        return self.get_parameter(name)

    def has_parameter(self, name: str) -> bool:
        """Return whether a parameter was declared."""
        return name in self._declared

    def get_parameter(self, name: str) -> SimpleNamespace:
        """Return a declared parameter."""
        parameter: SimpleNamespace = self._declared[name]
        return parameter

    def get_parameters_by_prefix(self, prefix: str) -> dict[str, SimpleNamespace]:
        """Return the parameters below a prefix; an empty prefix returns all."""
        return {name: it for name, it in self._declared.items() if name.startswith(prefix)}


def flat(table: Mapping[str, Any], prefix: str = '') -> dict[str, Any]:
    """Flatten nested tables to one table with dotted names."""
    names: dict[str, Any] = {}
    for name, value in table.items():
        if isinstance(value, dict):
            names |= flat(value, f'{prefix}{name}.')
        else:
            names[f'{prefix}{name}'] = value
    return names
