# SPDX-FileCopyrightText: 2026 The arm and quad developers
# SPDX-License-Identifier: Apache-2.0
"""The part of the check that needs kinematics: group, limits, and the pose to start from."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import Any, TYPE_CHECKING

from process_supervisor import parameters_by_node, StartError

from .description import read_semantic
from .exceptions import DescriptionError
from .findings import error, Finding, warning
from .robots import Robot

if TYPE_CHECKING:
    from arm_model import RobotModel

START = 'ready'
"""Pose of the SRDF from which an arm starts."""
SINGULAR = 0.05
"""Least singular value of the Jacobian, lengths divided by the reach, of a good start."""
CLEARANCE = 0.01
"""Least distance between links at the start in [m]."""


def check_motion(robot: Robot, urdf: str, joints: Sequence[str]) -> list[Finding]:
    """Look at the files that trajectories and jogging need.

    Args:
        robot: The robot; its SRDF and its limits exist.
        urdf: Its description.
        joints: Names of the movable joints in it.
    """
    try:
        from arm_model import LimitsError, load_limits, ModelError, RobotModel
        from arm_servo import check_arm
    except ImportError as problem:
        return [
            warning(
                robot.semantic.name,
                f'motion is not checked: {problem}',
                'make build builds arm_servo and gets what it needs; then source env.sh',
            )
        ]
    try:
        semantic = read_semantic(robot)
    except DescriptionError as problem:
        return [error(robot.semantic.name, str(problem), 'mend it: the arm has no group without')]
    try:
        limits = load_limits(robot.limits)
    except LimitsError as problem:
        return [error(robot.limits.name, str(problem), 'write it as robots/gp110/limits.yaml is')]
    findings = list(_limits(robot, limits, joints))
    try:
        model = RobotModel(urdf, semantic, limits, robot.group or None, robot.tip_link or None)
        check_arm(model)
    except LimitsError as problem:
        remedy = (
            'give each joint of the group max_velocity, max_acceleration and max_jerk, none wider'
            f' than in {robot.description.name}'
        )
        return [*findings, error(robot.limits.name, str(problem), remedy)]
    except ModelError as problem:
        remedy = f'name links and joints as {robot.description.name} does; see robots/gp110/'
        return [*findings, error(robot.semantic.name, str(problem), remedy)]
    findings += [
        warning(robot.semantic.name, note, 'mend it, or leave it') for note in model.notes
    ]
    findings += _start(robot, model)
    findings += _controllers(robot, model)
    return findings


def _limits(robot: Robot, limits: Any, joints: Sequence[str]) -> Iterable[Finding]:  # noqa: ANN401  # YAML
    for name in limits:
        if name not in joints:
            yield error(
                f'{robot.limits.name}, {name}',
                f'{robot.description.name} has no such joint',
                f'take it out, or name it as the joint; joints: {", ".join(joints)}',
            )


def _start(robot: Robot, model: RobotModel) -> Iterable[Finding]:
    import numpy as np

    place = f'{robot.semantic.name}, pose {START!r}'
    if START not in model.poses:
        known = ', '.join(model.poses) or 'none'
        yield error(
            robot.semantic.name,
            f'group {model.group} has no pose {START!r} to start from; poses: {known}',
            f'add <group_state name="{START}" group="{model.group}"> with all its joints',
        )
        return
    start = model.poses[START]
    jacobian = np.array(model.jacobian(start))
    jacobian[:3] /= model.reach
    least = float(np.linalg.svd(jacobian, compute_uv=False)[min(jacobian.shape) - 1])
    if least < SINGULAR:
        yield error(
            place,
            f'it is singular (least singular value {least:.4f}): some directions cannot be jogged',
            'bend the elbow and the wrist, by 90 degrees for instance',
        )
    clearance = model.clearance(start)
    if clearance < CLEARANCE:
        pair = model.nearest(start, CLEARANCE, 1)[0].links
        yield error(
            place,
            f'{pair[0]} and {pair[1]} are {1e3 * clearance:.0f} mm apart'
            if clearance > 0.0
            else f'{pair[0]} and {pair[1]} collide, by {-1e3 * clearance:.0f} mm',
            'move them apart, or disable the pair in the SRDF if they can never meet',
        )


def _controllers(robot: Robot, model: RobotModel) -> Iterable[Finding]:
    from arm_servo import check_parameters

    if not robot.controllers.is_file():
        return
    place = robot.controllers.name
    try:
        table = parameters_by_node(robot.controllers)
        manager = table.get('controller_manager', {}).get('ros__parameters', {})
        name = manager.get('controller_name', f'{model.group}_controller')
        constraints = table.get(name, {}).get('ros__parameters', {}).get('constraints', {})
        refused = check_parameters(model, table)
    except (StartError, AttributeError, TypeError) as problem:
        yield error(place, f'not a parameter file: {problem}', 'see robots/gp110/controllers.yaml')
        return
    if name not in table:
        known = ', '.join(table)
        yield warning(place, f'no parameters of {name!r}; nodes: {known}', f'name one {name}')
    for joint, values in constraints.items():
        if isinstance(values, dict) and joint not in model.joints:
            yield error(
                f'{place}, {name}, constraints',
                f'group {model.group} has no joint {joint!r}',
                f'joints: {", ".join(model.joints)}',
            )
    for node, reason in refused:
        remedy = 'mend it: the node would end with these words; README of arm_servo has them all'
        yield error(f'{place}, {node}', reason, remedy)
